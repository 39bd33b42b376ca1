//! The system that the package is installed on: programs, units, files, journal.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

pub(crate) const SERVICE: &str = "reliefd.service";
pub(crate) const SOCKET: &str = "reliefd.socket";

/// Longest wait for anything: the machine is emulated, and may have little of its host.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

/// What a program says, whatever it ends with; and whether it ended well.
pub(crate) fn try_run(program: &str, arguments: &[&str]) -> Result<(bool, String, String)> {
    let output = Command::new(program)
        .args(arguments)
        .env("LC_ALL", "C")
        .env("SYSTEMD_PAGER", "cat")
        .env("DEBIAN_FRONTEND", "noninteractive")
        .output()
        .with_context(|| format!("cannot start {program}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok((
        output.status.success(),
        text(&output.stdout),
        text(&output.stderr),
    ))
}

/// What a program prints, if it ends well.
pub(crate) fn run(program: &str, arguments: &[&str]) -> Result<String> {
    let (well, out, err) = try_run(program, arguments)?;
    ensure!(well, "{program} {}: {out} {err}", arguments.join(" "));
    Ok(out)
}

pub(crate) fn systemctl(arguments: &[&str]) -> Result<String> {
    run("systemctl", arguments)
}

/// A property of the service.
pub(crate) fn property(name: &str) -> Result<String> {
    systemctl(&["show", SERVICE, "--value", "--property", name])
}

pub(crate) fn number(name: &str) -> Result<u32> {
    let value = property(name)?;
    value
        .parse()
        .with_context(|| format!("{name} is {value:?}"))
}

/// Waits until something holds; what is waited for is told when it does not.
pub(crate) fn wait(what: &str, mut holds: impl FnMut() -> Result<bool>) -> Result<Duration> {
    let start = Instant::now();
    while !holds().with_context(|| what.to_owned())? {
        if start.elapsed() > LIMIT {
            bail!("in vain: {what}");
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    Ok(start.elapsed())
}

pub(crate) fn is_active(unit: &str) -> Result<bool> {
    Ok(try_run("systemctl", &["is-active", "--quiet", unit])?.0)
}

/// True if the kernel has a driver of devices of this kind.
pub(crate) fn knows_device(kind: &str) -> Result<bool> {
    let devices = fs::read_to_string("/proc/devices")?;
    Ok(devices
        .lines()
        .any(|line| line.split_whitespace().nth(1) == Some(kind)))
}

pub(crate) fn exists(path: &str) -> bool {
    Path::new(path).exists()
}

/// Permissions (as a number), user and group of a file.
pub(crate) fn owner(path: &str) -> Result<(u32, u32, u32)> {
    let file = fs::metadata(path).with_context(|| format!("no {path}"))?;
    Ok((file.mode() & 0o7777, file.uid(), file.gid()))
}

/// A number out of `/etc/passwd` or `/etc/group`.
pub(crate) fn id_of(file: &str, name: &str) -> Result<u32> {
    let list = fs::read_to_string(file)?;
    list.lines()
        .find_map(|line| {
            let mut fields = line.split(':');
            (fields.next() == Some(name)).then(|| fields.nth(1))?
        })
        .and_then(|id| id.parse().ok())
        .with_context(|| format!("{name} is not in {file}"))
}

/// A field of `/proc/PID/status`.
pub(crate) fn process_status(pid: u32, field: &str) -> Result<String> {
    let status = fs::read_to_string(format!("/proc/{pid}/status"))?;
    status
        .lines()
        .find_map(|line| line.strip_prefix(field)?.strip_prefix(':'))
        .map(|value| value.trim().to_owned())
        .with_context(|| format!("no {field}"))
}

/// The journal's entries that match.
pub(crate) fn journal(matches: &[&str]) -> Result<Vec<Value>> {
    let mut words = vec!["--output", "json", "--all", "--no-pager"];
    words.extend(matches);
    let (_, entries, _) = try_run("journalctl", &words)?;
    entries
        .lines()
        .map(|line| serde_json::from_str(line).with_context(|| line.to_owned()))
        .collect()
}

/// What has last been said by and about the service.
pub(crate) fn recent_log() -> String {
    let words = [
        "--unit",
        SERVICE,
        "--unit",
        SOCKET,
        "--lines",
        "25",
        "--no-pager",
    ];
    try_run("journalctl", &words).map_or_else(|error| format!("{error:#}"), |(_, said, _)| said)
}
