//! The last step before a hook's command runs: `reliefd hook-child` confines itself, and becomes
//! the command. A program of its own, since what it does between fork and exec would need unsafe
//! code in the service's own process.

use std::convert::Infallible;
use std::ffi::OsString;
use std::fs;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use landlock::{
    ABI, Access, AccessFs, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, RulesetStatus,
    Scope, path_beneath_rules,
};
use rustix::process::{
    Pid, Resource, Rlimit, Signal, getppid, set_parent_process_death_signal, setrlimit,
};
use serde::{Deserialize, Serialize};

/// Names this way to run `reliefd`.
pub const HOOK_CHILD: &str = "hook-child";

/// What ends a hook whose confinement does not work; the command itself has other codes.
pub(crate) const NOT_CONFINED: u8 = 125;
/// What ends a hook whose command cannot be started, as in a shell.
pub(crate) const NOT_STARTED: u8 = 127;

/// By how much hooks are nicer than the taking of scans.
const NICER: i32 = 10;
/// Open files of a hook's process.
const MOST_FILES: u64 = 1_024;

/// Of the newest kernel whose rights are known here; an older one is asked for what it has.
const RIGHTS: ABI = ABI::V6;

/// Where programs, their libraries and what they need lie.
const PROGRAMS: [&str; 7] = ["/bin", "/lib", "/lib32", "/lib64", "/opt", "/sbin", "/usr"];
/// Files that programs take for granted.
const DEVICES: [&str; 5] = [
    "/dev/full",
    "/dev/null",
    "/dev/random",
    "/dev/urandom",
    "/dev/zero",
];
/// Secrets of webhooks lie there.
const OUR_SETTINGS: &str = "relief";

/// What a hook may do, and its command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Confined {
    /// The service; the hook ends with it.
    pub(crate) parent: i32,
    /// Processor seconds of each process.
    pub(crate) cpu_s: u64,
    /// Address space of each process.
    pub(crate) memory_bytes: u64,
    /// Most bytes of a file that it writes.
    pub(crate) file_bytes: u64,
    /// Processes and threads that the service's user may have for it to start another.
    pub(crate) processes: u64,
    /// Folders that it may read on top of programs and `/etc`, and the one that it may write;
    /// without them, whatever the service's user may.
    pub(crate) folders: Option<Folders>,
    /// The program, which is absolute, and its arguments.
    pub(crate) command: Vec<String>,
}

/// What Landlock leaves open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Folders {
    pub(crate) read: Vec<PathBuf>,
    pub(crate) write: PathBuf,
}

/// Becomes the command that the arguments after `hook-child` name, confined as they say.
#[must_use]
pub fn become_hook(arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let Err((code, message)) = confine(arguments);
    eprintln!("reliefd: {message}");
    ExitCode::from(code)
}

fn confine(mut arguments: impl Iterator<Item = OsString>) -> Result<Infallible, (u8, String)> {
    let failed = |what: &str, error: &dyn std::fmt::Display| {
        (
            NOT_CONFINED,
            format!("the hook cannot be confined: {what}: {error}"),
        )
    };
    let text = arguments.next().unwrap_or_default();
    let confined: Confined = serde_json::from_slice(text.as_encoded_bytes()).map_err(|error| {
        failed(
            "this is how the service runs hooks, and nobody else",
            &error,
        )
    })?;
    let [program, words @ ..] = confined.command.as_slice() else {
        return Err(failed("command", &"there is none"));
    };
    set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(|error| failed("PR_SET_PDEATHSIG", &error))?;
    if getppid().map(Pid::as_raw_pid) != Some(confined.parent) {
        return Err(failed("parent", &"the service has ended"));
    }
    rustix::thread::set_no_new_privs(true)
        .map_err(|error| failed("PR_SET_NO_NEW_PRIVS", &error))?;
    // Behind scans, as jobs are.
    rustix::process::nice(NICER).map_err(|error| failed("nice", &error))?;
    for (resource, most) in [
        (Resource::Cpu, confined.cpu_s),
        (Resource::As, confined.memory_bytes),
        (Resource::Fsize, confined.file_bytes),
        (Resource::Nproc, confined.processes),
        (Resource::Nofile, MOST_FILES),
        // A dump might hold what the hook has read.
        (Resource::Core, 0),
    ] {
        // Somebody may have set a lower one already.
        let least = |limit: Option<u64>| Some(limit.map_or(most, |limit| limit.min(most)));
        let now = rustix::process::getrlimit(resource);
        let limit = Rlimit {
            current: least(now.maximum),
            maximum: least(now.maximum),
        };
        setrlimit(resource, limit).map_err(|error| failed("setrlimit", &error))?;
    }
    if let Some(folders) = &confined.folders {
        restrict(program, folders).map_err(|error| failed("Landlock", &error))?;
    }
    let error = Command::new(program).args(words).exec();
    Err((NOT_STARTED, format!("cannot start {program}: {error}")))
}

/// Leaves a hook with programs, what they need, and its folders.
fn restrict(program: &str, folders: &Folders) -> Result<(), RulesetError> {
    let mut read = folders.read.clone();
    read.push(program.into());
    read.extend(PROGRAMS.map(PathBuf::from));
    // One by one, as what is once let in cannot be taken out.
    let settings = fs::read_dir("/etc").into_iter().flatten().flatten();
    let others = settings.filter(|entry| entry.file_name() != OUR_SETTINGS);
    read.extend(others.map(|entry| entry.path()));
    let reading = AccessFs::from_read(RIGHTS);
    let devices = AccessFs::ReadFile | AccessFs::WriteFile;
    let status = Ruleset::default()
        .handle_access(AccessFs::from_all(RIGHTS))?
        .scope(Scope::from_all(RIGHTS))?
        .create()?
        .add_rules(path_beneath_rules(&read, reading))?
        .add_rules(path_beneath_rules(DEVICES, devices))?
        .add_rules(path_beneath_rules(
            [&folders.write],
            AccessFs::from_all(RIGHTS),
        ))?
        .restrict_self()?;
    if status.ruleset == RulesetStatus::NotEnforced {
        eprintln!("reliefd: this kernel has no Landlock: the hook may read what the service may");
    }
    Ok(())
}
