//! One run of a confined program: its process from its beginning to its end.

use std::fs;
use std::io::{self, PipeReader, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use crate::confined::{Confined, HOOK_CHILD};

/// How often it is looked whether a process has ended.
const LOOK: Duration = Duration::from_millis(20);
/// How often a pipe is read before the clock is looked at.
const MOST_READS: usize = 64;
/// Of what a hook says, the end is kept.
pub(super) const MOST_OUTPUT_BYTES: usize = 4_096;

/// When a run has to end.
pub(super) struct Until<'a> {
    pub(super) time: Instant,
    /// The service ends.
    pub(super) closing: &'a AtomicBool,
}

/// What became of a run.
#[derive(Debug)]
pub(super) struct Ran {
    /// None where it had to be killed, since its time was over.
    pub(super) status: Option<ExitStatus>,
    /// The end of what it said, on standard output and standard error together.
    pub(super) output: Vec<u8>,
}

/// Runs a hook in a folder of its own, which is gone afterwards, and kills whatever is left of it
/// once its command has ended or its time is over.
pub(super) fn run(
    program: &Path,
    confined: &Confined,
    environment: &[(&str, String)],
    folder: &Path,
    until: &Until<'_>,
) -> io::Result<Ran> {
    remove_if_there(folder)?;
    fs::create_dir_all(folder)?;
    let ran = in_folder(program, confined, environment, folder, until);
    if let Err(error) = remove_if_there(folder) {
        tracing::warn!(folder = %folder.display(), %error, "cannot remove what a hook left");
    }
    ran
}

fn remove_if_there(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

fn in_folder(
    program: &Path,
    confined: &Confined,
    environment: &[(&str, String)],
    folder: &Path,
    until: &Until<'_>,
) -> io::Result<Ran> {
    let (reader, writer) = io::pipe()?;
    rustix::io::ioctl_fionbio(&reader, true)?;
    let described = serde_json::to_string(confined).map_err(io::Error::other)?;
    let child = Command::new(program)
        .args([HOOK_CHILD, &described])
        .env_clear()
        .envs(environment.iter().map(|(name, value)| (name, value)))
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(writer.try_clone()?)
        .stderr(writer)
        .process_group(0)
        .spawn()?;
    let mut running = Running {
        child,
        output: Output {
            reader,
            end: Vec::new(),
            is_over: false,
        },
    };
    let ended = running.wait(until);
    let status = running.end()?;
    let ended = ended?;
    Ok(Ran {
        status: ended.then_some(status),
        output: running.output.end,
    })
}

/// A process that leads its own group.
struct Running {
    child: Child,
    output: Output,
}

impl Running {
    fn pid(&self) -> io::Result<Pid> {
        let raw = i32::try_from(self.child.id()).map_err(io::Error::other)?;
        Pid::from_raw(raw).ok_or_else(|| io::Error::other("a process without a number"))
    }

    /// Waits for the end of the command, which stays a zombie, so that its number is not given
    /// to another. False if its time is over before.
    fn wait(&mut self, until: &Until<'_>) -> io::Result<bool> {
        let pid = self.pid()?;
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        loop {
            self.output.take();
            if waitid(WaitId::Pid(pid), options)?.is_some() {
                return Ok(true);
            }
            if Instant::now() >= until.time || until.closing.load(Ordering::Relaxed) {
                return Ok(false);
            }
            self.output.wait();
        }
    }

    /// Kills the whole group, and takes what it said last.
    fn end(&mut self) -> io::Result<ExitStatus> {
        // Also where the command has ended: it may have left others behind.
        let killed = kill_process_group(self.pid()?, Signal::KILL);
        if let Err(error) = killed {
            tracing::debug!(%error, "nothing of a hook was left to be killed");
        }
        let status = self.child.wait();
        self.output.take();
        status
    }
}

/// What a hook says.
struct Output {
    reader: PipeReader,
    /// The last of it.
    end: Vec<u8>,
    is_over: bool,
}

impl Output {
    /// Takes what is there, and not for ever from who says it without end.
    fn take(&mut self) {
        let mut bytes = [0; 4_096];
        for _ in 0..MOST_READS {
            match self.reader.read(&mut bytes) {
                Ok(0) => {
                    self.is_over = true;
                    return;
                }
                Ok(count) => {
                    self.end.extend_from_slice(&bytes[..count]);
                    let surplus = self.end.len().saturating_sub(MOST_OUTPUT_BYTES);
                    self.end.drain(..surplus);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(_) => {
                    self.is_over = true;
                    return;
                }
            }
        }
    }

    /// Waits for more, but not for long.
    fn wait(&self) {
        if self.is_over {
            std::thread::sleep(LOOK);
            return;
        }
        let timeout = Timespec::try_from(LOOK).ok();
        let mut polled = [PollFd::new(&self.reader, PollFlags::IN)];
        // Whatever comes of it, it is looked at anew.
        let _ = poll(&mut polled, timeout.as_ref());
    }
}
