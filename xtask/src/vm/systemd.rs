//! The Debian package where systemd is PID 1.

use std::time::Duration;

use anyhow::Result;
use clap::Args;

use super::archive::Archive;
use super::machine::Machine;
use super::packages::Packages;
use super::{guest_programs, image, modules, verdict};
use crate::{deb, shell};

/// Several times what it takes on a machine that has other work.
const PATIENCE_S: u64 = 900;

const MEMORY_MB: u32 = 1024;

/// Before the disk can be read, and for the scanner's plug.
const MODULES: [&str; 5] = [
    "virtio_pci",
    "virtio_blk",
    "crc32c_generic",
    "ext4",
    "vhci-hcd",
];

/// On the disk, where the system finds them when it needs them, as on any machine.
const DRIVERS: [&str; 2] = ["cdc-acm", "usbserial"];

/// Nobody logs in at the console, which is the checks'.
const PARAMETERS: &str = "mitigations=off systemd.show_status=0 systemd.mask=getty.target \
    systemd.mask=serial-getty@ttyS0.service systemd.wants=relief-vm.service";

/// From the kernel's hands to systemd's.
const INIT: &str = include_str!("../../../tests/vm/systemd/init.sh");

/// What is wanted of the machine.
#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Leave out what takes longest.
    #[arg(long)]
    short: bool,
    /// Only the checks whose names contain this, and those that they build on.
    #[arg(long, value_name = "WORD", conflicts_with = "short")]
    only: Option<String>,
    /// Let the processor run the machine: quicker, where nested virtualisation works.
    #[arg(long)]
    kvm: bool,
    /// Seconds after which the machine is ended.
    #[arg(long, default_value_t = PATIENCE_S)]
    patience_s: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            short: false,
            only: None,
            kvm: false,
            patience_s: PATIENCE_S,
        }
    }
}

pub(super) fn run(options: &Options) -> Result<()> {
    let home = shell::target().join("vm");
    let packages = Packages::ready(&home)?;
    let disk = image::ready(&home)?;
    deb::build_programs()?;
    let package = deb::pack(None)?;
    let later = deb::pack(Some(&later_version()))?;
    let programs = guest_programs(&["relief-vm-systemd"])?;

    let mut archive = Archive::default();
    archive.text("init", INIT);
    archive.file("bin/busybox", &packages.file("bin/busybox")?)?;
    modules::add_in_order(&mut archive, packages.modules(), &MODULES)?;
    // From here on: what is put upon the disk.
    modules::add_as_installed(&mut archive, packages.modules(), &DRIVERS)?;
    archive.file(
        "inject/usr/local/bin/relief-vm-systemd",
        &programs.join("relief-vm-systemd"),
    )?;
    archive.text(
        "inject/etc/systemd/system/relief-vm.service",
        &unit(options),
    );
    archive.text(
        "inject/etc/machine-id",
        "0123456789abcdef0123456789abcdef\n",
    );
    archive.file("inject/packages/relief.deb", &package)?;
    archive.file("inject/packages/later.deb", &later)?;
    for drop_in in ["loopback.conf", "network.conf"] {
        archive.file(
            &format!("inject/packages/{drop_in}"),
            &shell::root().join("systemd").join(drop_in),
        )?;
    }
    let initramfs = home.join("systemd.cpio");
    archive.write(&initramfs)?;
    let said = Machine {
        kernel: packages.kernel(),
        initramfs: &initramfs,
        disk: Some(&disk),
        memory_mb: MEMORY_MB,
        // Service, scanner and whoever asks work side by side.
        processors: 2,
        parameters: PARAMETERS,
        kvm: options.kvm,
        patience: Duration::from_secs(options.patience_s),
    }
    .run()?;
    verdict(&said)
}

/// Later than the product's own, and earlier than its next.
fn later_version() -> String {
    format!("{}+upgrade-1", env!("CARGO_PKG_VERSION"))
}

/// Runs the checks, at the console.
fn unit(options: &Options) -> String {
    let which = match &options.only {
        Some(word) => format!(" --only {word}"),
        None if options.short => " --short".to_owned(),
        None => String::new(),
    };
    format!(
        "[Unit]\nDescription=The checks\nAfter=basic.target\n\
         [Service]\nType=exec\nExecStart=/usr/local/bin/relief-vm-systemd{which}\n\
         StandardInput=tty-force\nTTYPath=/dev/ttyS0\nStandardOutput=tty\nStandardError=tty\n"
    )
}
