//! What the project's udev rules make of a scanner, by udev itself.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use sim_scanner::endpoint::usb::{Attachment, Personality};

use super::serial::PORT;
use super::{Check, wait_for_path};
use crate::client::said_by_another;
use crate::scan::{config, listed};

pub(crate) const CHECKS: [Check; 1] =
    [("udev: group, mode, name, no sleep; others kept away", rules)];

/// Group `relief` in the machine's list.
const RELIEF: u32 = 990;

fn udevadm(arguments: &[&str]) -> Result<String> {
    let output = Command::new("/bin/udevadm")
        .args(arguments)
        .output()
        .context("no udevadm")?;
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    ensure!(output.status.success(), "udevadm {arguments:?}: {said}");
    Ok(said)
}

fn start_udev() -> Result<()> {
    let status = Command::new("/lib/systemd/systemd-udevd")
        .arg("--daemon")
        .status()
        .context("no udev")?;
    ensure!(status.success(), "udev does not start");
    Ok(())
}

fn settle() -> Result<()> {
    udevadm(&["settle", "--timeout=30"]).map(|_| ())
}

fn mode_and_group(path: &Path) -> Result<(u32, u32)> {
    let file = fs::metadata(path).with_context(|| format!("no {}", path.display()))?;
    Ok((file.mode() & 0o777, file.gid()))
}

fn rules() -> Result<()> {
    start_udev()?;
    let config = config();

    let server = config.serve_usb(
        config.source()?,
        Personality::Vendor,
        Attachment::ThisMachine,
    )?;
    let device = listed()?;
    settle()?;
    ensure!(
        mode_and_group(&device.node)? == (0o660, RELIEF),
        "{}",
        device.node.display()
    );
    ensure!(!device.may_sleep(), "it may be put to sleep");
    let known = udevadm(&["info", &device.node.display().to_string()])?;
    ensure!(known.contains("ID_MM_DEVICE_IGNORE=1"), "{known}");
    ensure!(known.contains(":uaccess:"), "{known}");
    // The machine's own rules, like brltty's, ask for a program.
    ensure!(known.contains("ASKED_FOR_BRLTTY=1"), "{known}");
    ensure!(!known.contains("SYSTEMD_WANTS=brltty"), "{known}");
    let said = said_by_another("usb", &config.device.serial, RELIEF)?;
    ensure!(
        said.starts_with("it answers"),
        "a member of the group: {said}"
    );
    drop(server);

    wait_for_path(PORT, false)?;
    let _server = config.serve_usb(
        config.source()?,
        Personality::CdcAcm,
        Attachment::ThisMachine,
    )?;
    wait_for_path(PORT, true)?;
    settle()?;
    ensure!(
        mode_and_group(Path::new(PORT))? == (0o660, RELIEF),
        "{PORT}"
    );
    let name = format!("/dev/relief/scanner-{}", config.device.serial);
    ensure!(fs::canonicalize(&name)? == Path::new(PORT), "{name}");
    let known = udevadm(&["info", PORT])?;
    ensure!(known.contains("ID_MM_PORT_IGNORE=1"), "{known}");
    let said = said_by_another("serial", &name, RELIEF)?;
    ensure!(
        said.starts_with("it answers"),
        "a member of the group: {said}"
    );
    Ok(())
}
