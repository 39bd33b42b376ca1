//! Both drivers against USB devices: the guest has one program of ours as its init.

use std::time::Duration;

use anyhow::{Context, Result};

use super::archive::Archive;
use super::machine::Machine;
use super::packages::Packages;
use super::{Options, guest_programs, modules, verdict};
use crate::shell;

/// Loaded by a check only.
const SPARE_MODULE: &str = "usbserial";

/// What the guest's kernel needs besides itself.
const MODULES: [&str; 6] = [
    "vhci-hcd",
    "cdc-acm",
    "dummy_hcd",
    "usb_f_acm",
    "usb_f_fs",
    "usb_f_ss_lb",
];

const MEMORY_MB: u32 = 512;

/// Runs every check.
pub(super) fn run(options: &Options) -> Result<()> {
    verdict(&boot(options, "")?)
}

/// Only measures how fast each way is; gives the rows of the table.
pub(super) fn throughput(options: &Options) -> Result<String> {
    let said = boot(options, "relief.throughput")?;
    verdict(&said)?;
    let lines = said.lines().filter(|line| line.starts_with('|'));
    Ok(lines.flat_map(|line| [line, "\n"]).collect())
}

fn boot(options: &Options, parameters: &str) -> Result<String> {
    let home = shell::target().join("vm");
    let packages = Packages::ready(&home)?;
    let programs = guest_programs(&["relief-vm-usb", "sim-scanner"])?;
    let mut archive = Archive::default();
    archive.file("init", &programs.join("relief-vm-usb"))?;
    archive.file("bin/sim-scanner", &programs.join("sim-scanner"))?;
    archive.file("bin/busybox", &packages.file("bin/busybox")?)?;
    for (place, program) in [
        ("usr/sbin/usbip", "usr/sbin/usbip"),
        ("bin/udevadm", "bin/udevadm"),
        // One program: its name says what it does.
        ("lib/systemd/systemd-udevd", "bin/udevadm"),
    ] {
        archive.program(place, &packages.file(program)?, &packages.libraries())?;
    }
    // The tool does not start without its list of names, which may be empty.
    archive.text("usr/share/hwdata/usb.ids", "");
    archive.folder("var/run");
    archive.folder("run");
    udev(&mut archive, &packages)?;
    modules::add_in_order(&mut archive, packages.modules(), &MODULES)?;
    // A driver that takes the scanner away, for one check.
    let spare = modules::in_order(packages.modules(), &[SPARE_MODULE])?;
    let spare = spare.last().context("no module")?;
    archive.file(&format!("spare/{SPARE_MODULE}.ko"), spare)?;
    let initramfs = home.join("usb.cpio");
    archive.write(&initramfs)?;
    Machine {
        kernel: packages.kernel(),
        initramfs: &initramfs,
        disk: None,
        memory_mb: MEMORY_MB,
        processors: 1,
        parameters,
        kvm: options.kvm,
        patience: Duration::from_secs(options.patience_s),
    }
    .run()
}

/// The rules of Debian's udev that deal with USB and serial ports, and ours.
fn udev(archive: &mut Archive, packages: &Packages) -> Result<()> {
    /// As brltty's do for adapters that it takes for its own.
    const LIKE_BRLTTY: &str = "SUBSYSTEM==\"usb\", ENV{PRODUCT}==\"1209/*\", TAG+=\"systemd\", \
        ENV{SYSTEMD_WANTS}=\"brltty-udev.service\", ENV{ASKED_FOR_BRLTTY}=\"1\"\n";
    let folder = "lib/udev/rules.d";
    for name in ["50-udev-default.rules", "60-serial.rules"] {
        let place = format!("{folder}/{name}");
        archive.file(&place, &packages.file(&place)?)?;
    }
    for name in ["60-relief-scanner.rules", "90-relief-scanner.rules"] {
        let ours = shell::root().join("systemd").join(name);
        archive.file(&format!("{folder}/{name}"), &ours)?;
    }
    archive.text(&format!("{folder}/85-like-brltty.rules"), LIKE_BRLTTY);
    archive.text("etc/passwd", "root:x:0:0::/:/bin/false\n");
    archive.text(
        "etc/group",
        "root:x:0:\ntty:x:5:\ndialout:x:20:\nrelief:x:990:\n",
    );
    Ok(())
}
