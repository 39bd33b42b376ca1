//! From the kernel's hands to a usable system, and back.

use std::ffi::CStr;
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result};
use rustix::mount::MountFlags;
use rustix::system::{RebootCommand, init_module, reboot};

/// Modules lie here, named so that their order is that of loading.
const MODULES: &str = "/modules";

/// File systems: type and place.
const MOUNTS: [(&str, &str); 4] = [
    ("devtmpfs", "/dev"),
    ("proc", "/proc"),
    ("sysfs", "/sys"),
    ("tmpfs", "/tmp"),
];

pub(crate) fn boot() -> Result<()> {
    for (kind, place) in MOUNTS {
        mount(kind, place)?;
    }
    mount("devpts", "/dev/pts")?;
    console()?;
    let mut modules: Vec<PathBuf> = fs::read_dir(MODULES)
        .with_context(|| format!("no {MODULES}"))?
        .flatten()
        .map(|entry| entry.path())
        .collect();
    modules.sort();
    for module in modules {
        load(&module, c"")?;
    }
    // Only there once the module is.
    mount("configfs", "/sys/kernel/config")?;
    let up = Command::new("/bin/busybox")
        .args(["ip", "link", "set", "lo", "up"])
        .status()
        .context("no busybox")?;
    anyhow::ensure!(up.success(), "the loopback network does not come up");
    Ok(())
}

/// Whether the kernel was started with this word.
pub(crate) fn is_asked_for(word: &str) -> bool {
    let line = fs::read_to_string("/proc/cmdline").unwrap_or_default();
    line.split_whitespace().any(|said| said == word)
}

/// Loads a module with these parameters.
pub(crate) fn load(module: &Path, parameters: &CStr) -> Result<()> {
    let image = fs::read(module)?;
    init_module(&image, parameters).with_context(|| format!("cannot load {}", module.display()))
}

pub(crate) fn mount(kind: &str, place: &str) -> Result<()> {
    fs::create_dir_all(place).with_context(|| format!("cannot make {place}"))?;
    rustix::mount::mount(kind, place, kind, MountFlags::empty(), None)
        .with_context(|| format!("cannot mount {kind} at {place}"))
}

/// The kernel starts an init of a bare archive without any file open.
fn console() -> Result<()> {
    let console = OpenOptions::new()
        .read(true)
        .write(true)
        .open("/dev/console")
        .context("no console")?;
    rustix::stdio::dup2_stdin(&console)?;
    rustix::stdio::dup2_stdout(&console)?;
    rustix::stdio::dup2_stderr(&console)?;
    Ok(())
}

/// Never returns: when the kernel refuses, the host's patience ends it.
pub(crate) fn power_off() -> ! {
    // Without a moment's pause the last line may be lost in the serial port.
    std::thread::sleep(Duration::from_millis(200));
    loop {
        let _ = reboot(RebootCommand::PowerOff);
        std::thread::sleep(Duration::from_secs(1));
    }
}
