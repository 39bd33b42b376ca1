//! Hooks: programs on this machine that are run for each result.
//!
//! What a program may do is bounded in a process of its own (`crate::confined`); this is what it is
//! told, and what becomes of it.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use relief_api::{DeliveryAttempt, Job, WebhookEvent, WebhookKind, WebhookMessage};

use super::FileError;
use super::receiver::{Receiver, Settings, Verdict, Way};
use super::run::{Ran, Until, run};
use crate::config::{HookConfig, HookSandbox};
use crate::confined::{Confined, Folders, NOT_CONFINED, NOT_STARTED};
use crate::store::Message;

/// Shorter than the command line waits for the outcome of a test.
const LONGEST_TEST: Duration = Duration::from_secs(25);
/// The program that confines itself, also where another has taken its place on disk since.
pub(super) const OURSELVES: &str = "/proc/self/exe";
/// What a hook has of the service's own environment.
const INHERITED: [&str; 2] = ["PATH", "LANG"];
/// Bytes of a megabyte.
const MB: u64 = 1_000_000;

/// The receiver of a section; `state_dir` is the service's.
pub(super) fn receiver(config: &HookConfig, state_dir: &Path) -> Receiver {
    let settings = Settings {
        name: config.name.clone(),
        kind: WebhookKind::Hook,
        shown: config.command.join(" "),
        events: vec![WebhookEvent::JobDone],
        timeout: config.timeout(),
        retry: config.retry,
    };
    let hook = Hook {
        config: config.clone(),
        closing: AtomicBool::new(false),
        folder: state_dir.join("hooks").join(&config.name),
    };
    Receiver::new(settings, hook)
}

/// Looks whether a hook's program is there.
pub(crate) fn check_command(config: &HookConfig) -> Result<(), FileError> {
    let program = Path::new(config.command.first().map_or("", String::as_str));
    let mode = program.metadata().map(|found| found.permissions().mode());
    let why = match mode {
        Ok(mode) if program.is_file() && mode & 0o111 != 0 => return Ok(()),
        Ok(_) => "it is no program that may be run: chmod +x, or name another".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(FileError {
        key: "command",
        message: format!("cannot run {}: {why}", program.display()),
    })
}

struct Hook {
    config: HookConfig,
    /// The service ends.
    closing: AtomicBool,
    /// Where its runs have their working folder, one at a time.
    folder: PathBuf,
}

impl Way for Hook {
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        let told: Option<WebhookMessage> = serde_json::from_str(&message.body).ok();
        let Some(job) = told.and_then(|told| told.data.job) else {
            attempt.error = Some("there is no result that it could be run for".into());
            return Verdict::Gone;
        };
        let directory = PathBuf::from(job.directory.as_deref().unwrap_or_default());
        if !directory.is_dir() {
            attempt.error = Some(format!("the result {} is not there any more", job.result));
            return Verdict::Gone;
        }
        let is_test = message.delivery.event == WebhookEvent::Test;
        let (folder, longest) = if is_test {
            // Beside a run that is under way.
            let folder = self.folder.with_extension("test");
            (folder, self.config.timeout().min(LONGEST_TEST))
        } else {
            (self.folder.clone(), self.config.timeout())
        };
        let event = if is_test { "test" } else { "published" };
        let environment = environment(event, &job, &directory, &folder);
        let helper = self.config.helper.as_deref();
        let ran = run(
            helper.unwrap_or(Path::new(OURSELVES)),
            &self.confined(&directory, &folder, longest),
            &environment,
            &folder,
            &Until {
                time: Instant::now() + longest,
                closing: &self.closing,
            },
        );
        match ran {
            Ok(ran) => self.judge(&ran, longest, attempt),
            Err(error) => {
                attempt.error = Some(format!("it cannot be run: {error}"));
                Verdict::Again
            }
        }
    }

    fn close(&self) {
        self.closing.store(true, Ordering::Relaxed);
    }
}

impl Hook {
    fn confined(&self, directory: &Path, folder: &Path, longest: Duration) -> Confined {
        let config = &self.config;
        let folders = || Folders {
            read: vec![directory.to_owned()],
            write: folder.to_owned(),
        };
        Confined {
            parent: rustix::process::getpid().as_raw_pid(),
            cpu_s: longest.as_secs().max(1),
            memory_bytes: u64::from(config.memory_mb) * MB,
            file_bytes: u64::from(config.file_mb) * MB,
            processes: config.processes.into(),
            folders: (config.sandbox == HookSandbox::On).then(folders),
            command: config.command.clone(),
        }
    }

    fn judge(&self, ran: &Ran, longest: Duration, attempt: &mut DeliveryAttempt) -> Verdict {
        let said = readable(&ran.output);
        tracing::info!(hook = self.config.name, output = said, "a hook was run");
        attempt.answer = Some(said).filter(|said| !said.is_empty());
        let code = ran.status.and_then(|status| status.code());
        attempt.status = code.and_then(|code| u16::try_from(code).ok());
        if code == Some(0) {
            return Verdict::Delivered;
        }
        attempt.error = Some(match ran.status {
            Some(status) => ended(status),
            None if self.closing.load(Ordering::Relaxed) => {
                "it was killed, since the service ended".into()
            }
            None => format!(
                "it had not ended after {} s (timeout_s), and was killed",
                longest.as_secs()
            ),
        });
        Verdict::Again
    }
}

/// What a hook said, line by line, with nothing that a terminal would obey.
pub(super) fn readable(output: &[u8]) -> String {
    let text = String::from_utf8_lossy(output);
    let plain = text
        .chars()
        .map(|c| if c == '\t' { ' ' } else { c })
        .filter(|&c| c == '\n' || !c.is_control());
    plain.collect::<String>().trim().to_owned()
}

/// How a command ended that did not succeed, and what to do about it.
fn ended(status: ExitStatus) -> String {
    /// By their numbers on all architectures of Linux that matter here.
    const KILLED: i32 = 9;
    const TIME: i32 = 24;
    const SIZE: i32 = 25;
    match (status.code().map(u8::try_from), status.signal()) {
        (Some(Ok(NOT_CONFINED)), _) => "it may not have been started: see what it said".into(),
        (Some(Ok(NOT_STARTED)), _) => {
            "its command may not be there: see what it said, and `command`".into()
        }
        (Some(Ok(code)), _) => format!("exit code {code}"),
        (_, Some(TIME)) => "it took more processor time than timeout_s".into(),
        (_, Some(SIZE)) => "it wrote a file of more than file_mb".into(),
        (_, Some(KILLED)) => "something killed it: is the machine out of memory?".into(),
        (_, Some(signal)) => format!("it was ended by the signal {signal}"),
        _ => status.to_string(),
    }
}

/// All that a hook finds in its environment.
fn environment<'a>(
    event: &'a str,
    job: &Job,
    directory: &Path,
    folder: &Path,
) -> Vec<(&'a str, String)> {
    let inherited = INHERITED.iter().filter_map(|&name| {
        let value = std::env::var(name).ok()?;
        Some((name, value))
    });
    let told = [
        ("HOME", "/nonexistent".to_owned()),
        ("TMPDIR", folder.display().to_string()),
        ("RELIEF_EVENT", event.to_owned()),
        ("RELIEF_RESULT", job.result.clone()),
        ("RELIEF_DIRECTORY", directory.display().to_string()),
        (
            "RELIEF_MANIFEST",
            directory
                .join(deliverables::MANIFEST_NAME)
                .display()
                .to_string(),
        ),
        ("RELIEF_SCAN", job.scan.clone()),
        ("RELIEF_SCANNER", job.scanner.clone()),
        ("RELIEF_NAME", job.name.clone()),
        ("RELIEF_JOB", job.id.to_string()),
    ];
    inherited.chain(told).collect()
}
