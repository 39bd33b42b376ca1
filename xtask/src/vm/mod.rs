//! Checks in a virtual machine, for what needs a kernel of one's own.
//!
//! The machine is emulated (KVM is used where it works and is asked for): a Debian kernel, a
//! file system in memory or on a disk, and a program of ours that runs the checks. Everything it
//! is made of lies in `vm` below cargo's target folder, and is made once.

mod archive;
mod image;
mod machine;
mod modules;
mod packages;
mod systemd;
mod usb;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, Subcommand};

use crate::shell;
pub(crate) use systemd::Options as SystemdOptions;

#[derive(Debug, Subcommand)]
pub(crate) enum Vm {
    /// Run both drivers against USB devices on a real kernel.
    ///
    /// Installs what it needs on Debian (as root; otherwise it says what to install), builds
    /// the guest's programs, boots, and prints what each check came to.
    Usb(Options),
    /// Install the Debian package where systemd is PID 1, and see the service through a hard
    /// life: killed, hung, its scanner pulled out, stopped in mid-scan, upgraded, purged.
    ///
    /// Installs what it needs on Debian, as root; builds package, guest and its disk.
    Systemd(SystemdOptions),
}

/// Several times what it takes on a machine that has other work.
const PATIENCE_S: u64 = 240;

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

pub(crate) fn run(vm: &Vm) -> Result<()> {
    match vm {
        Vm::Usb(options) => usb::run(options),
        Vm::Systemd(options) => systemd::run(options),
    }
}

/// Measures how fast each way to the scanner is, those over USB among them; gives the table.
pub(crate) fn throughput() -> Result<String> {
    usb::throughput(&Options {
        patience_s: 3 * PATIENCE_S,
        ..Options::default()
    })
}

/// What the guest's last line says of its checks.
fn verdict(said: &str) -> Result<()> {
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

/// Builds the guest's programs; gives their folder. They bring their own C library, since the
/// machine has none.
fn guest_programs(packages: &[&str]) -> Result<PathBuf> {
    let installed = shell::output("rustup", &["target", "list", "--installed"])?;
    if !installed.lines().any(|line| line == TARGET) {
        shell::run("rustup", &["target", "add", TARGET])?;
    }
    let mut words = vec!["build", "--release", "--target", TARGET];
    words.extend(packages.iter().flat_map(|package| ["--package", package]));
    shell::run("cargo", &words)?;
    Ok(shell::target().join(TARGET).join("release"))
}
