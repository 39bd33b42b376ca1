//! Lets OpenCASCADE judge solids of random parts.

use anyhow::{Context, Result};
use clap::Args;

use crate::{judge, shell};

/// Seeds begin here. Lower ones were looked at while the solids were made, or are those of tests.
const FIRST_SEED: &str = "100001";

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Parts.
    #[arg(long, default_value_t = 40)]
    pub(crate) parts: u32,
}

/// Writes solids, and has them judged.
pub(crate) fn run(options: &Options) -> Result<()> {
    let place = shell::root().join("target/judges");
    let python = judge::python(&place, &[])?;
    let out = place.join("solids");
    if out.exists() {
        std::fs::remove_dir_all(&out).with_context(|| format!("cannot empty {}", out.display()))?;
    }
    let folder = out.display().to_string();
    let parts = options.parts.to_string();
    let words = [
        "run",
        "--quiet",
        "--release",
        "--package",
        "cad-exchange",
        "--example",
        "random_solids",
        "--",
        &folder,
        FIRST_SEED,
        &parts,
    ];
    shell::run("cargo", &words)?;
    let check = "tests/judges/terraces/check.py";
    shell::run(&python, &["-B", check, &folder, "--least", &parts])
}
