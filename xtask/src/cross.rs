//! Whether the product compiles for other processors than this machine's.

use std::process::Command;

use anyhow::{Result, bail};
use clap::Args;

use crate::{apt, shell};

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// The service and the command line too, whose libraries need a C compiler for that processor.
    #[arg(long)]
    pub(crate) whole: bool,
}

/// 64-bit Arm: the lanes of the regridder are NEON's there.
const TARGET: &str = "aarch64-unknown-linux-gnu";
/// Debian's C compiler for it, as build scripts look for it.
const C_COMPILER: &str = "aarch64-linux-gnu-gcc";
const C_PACKAGE: &str = "gcc-aarch64-linux-gnu";
const C_LIBRARY: &str = "libc6-dev-arm64-cross";

/// Checks the geometry, or the whole product, for 64-bit Arm.
pub(crate) fn check(options: &Options) -> Result<()> {
    if Command::new("rustup").arg("--version").output().is_err() {
        bail!("needs rustup, for the standard library of {TARGET}");
    }
    shell::quiet("rustup", &["target", "add", TARGET])?;
    let mut words = vec!["check", "--target", TARGET];
    if options.whole {
        apt::need(&[(C_COMPILER, C_PACKAGE), (C_COMPILER, C_LIBRARY)])?;
        words.extend(["--package", "relief", "--package", "reliefd"]);
    } else {
        words.extend(["--package", "pipeline", "--package", "cad-exchange"]);
    }
    shell::run("cargo", &words)
}
