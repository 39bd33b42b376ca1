//! Checks in a virtual machine, for what needs a kernel of one's own.
//!
//! The machine is emulated (KVM is used where it works and is asked for): a Debian kernel, a
//! file system in memory, and one program of ours as its init. Everything it is made of lies
//! in `vm` below cargo's target folder, and is made once.

mod archive;
mod machine;
mod modules;
mod packages;

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};

use crate::shell;
use archive::Archive;
use machine::Machine;
use packages::Packages;

#[derive(Debug, Subcommand)]
pub(crate) enum Vm {
    /// Run both drivers against USB devices on a real kernel.
    ///
    /// Installs what it needs on Debian (as root; otherwise it says what to install), builds
    /// the guest's programs, boots, and prints what each check came to.
    Usb(Options),
}

/// Several times what it takes on a machine that has other work.
const PATIENCE_S: u64 = 240;

/// Loaded by a check only.
const SPARE_MODULE: &str = "usbserial";

#[derive(Debug, Args)]
pub(crate) struct Options {
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
            kvm: false,
            patience_s: PATIENCE_S,
        }
    }
}

const TARGET: &str = "x86_64-unknown-linux-musl";

/// What the guest's kernel needs besides itself.
const MODULES: [&str; 6] = [
    "vhci-hcd",
    "cdc-acm",
    "dummy_hcd",
    "usb_f_acm",
    "usb_f_fs",
    "usb_f_ss_lb",
];

pub(crate) fn run(vm: &Vm) -> Result<()> {
    match vm {
        Vm::Usb(options) => usb(options),
    }
}

/// The target folder that cargo uses.
fn target() -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    shell::root().join(chosen.map_or_else(|| "target".into(), PathBuf::from))
}

fn usb(options: &Options) -> Result<()> {
    let home = target().join("vm");
    let packages = Packages::ready(&home)?;
    let programs = guest_programs()?;
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
    for (number, module) in modules::in_order(packages.modules(), &MODULES)?
        .iter()
        .enumerate()
    {
        let name = module
            .file_name()
            .context("a module without a name")?
            .to_string_lossy();
        archive.file(&format!("modules/{number:02}-{name}"), module)?;
    }
    // A driver that takes the scanner away, for one check.
    let spare = modules::in_order(packages.modules(), &[SPARE_MODULE])?;
    let spare = spare.last().context("no module")?;
    archive.file(&format!("spare/{SPARE_MODULE}.ko"), spare)?;
    let initramfs = home.join("usb.cpio");
    archive.write(&initramfs)?;
    let said = Machine {
        kernel: packages.kernel(),
        initramfs: &initramfs,
        kvm: options.kvm,
        patience: Duration::from_secs(options.patience_s),
    }
    .run()?;
    match said
        .lines()
        .find_map(|line| line.trim().strip_prefix("GUEST-FAILED "))
    {
        Some("0") => {
            println!("vm: every check holds");
            Ok(())
        }
        Some(failed) => bail!("{failed} checks failed in the virtual machine; see above"),
        None => bail!("the virtual machine ended before its checks did; see above"),
    }
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

/// Builds the guest's programs; gives their folder. They bring their own C library, since the
/// machine has none.
fn guest_programs() -> Result<PathBuf> {
    let installed = shell::output("rustup", &["target", "list", "--installed"])?;
    if !installed.lines().any(|line| line == TARGET) {
        shell::run("rustup", &["target", "add", TARGET])?;
    }
    let mut words = vec!["build", "--release", "--target", TARGET];
    words.extend(["--package", "relief-vm-usb", "--package", "sim-scanner"]);
    shell::run("cargo", &words)?;
    Ok(target().join(TARGET).join("release"))
}
