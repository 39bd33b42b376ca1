//! Lets opencamlib, a removal simulation of its own and LinuxCNC judge cutters, paths and NC code.

use anyhow::{Context, Result};
use clap::Args;

use crate::{apt, judge, shell};

/// The judge's packages, pinned: another release may judge otherwise.
const PACKAGES: [&str; 3] = ["opencamlib==2023.1.11", "numpy==2.4.6", "numba==0.68.1"];
/// Seeds begin here; lower ones were looked at while the paths were made.
const FIRST_SEED: &str = "101";
/// Places at which either drops its cutter, for each surface.
const PLACES: &str = "1000";

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Surfaces, each with a cutter of its own.
    #[arg(long, default_value_t = 4)]
    pub(crate) surfaces: u32,
    /// Also have LinuxCNC's interpreter read the NC code (Debian package `linuxcnc-uspace`).
    #[arg(long)]
    pub(crate) linuxcnc: bool,
}

/// Makes surfaces and paths, and has them judged.
pub(crate) fn run(options: &Options) -> Result<()> {
    let place = shell::root().join("target/judges/toolpath");
    let python = judge::environment(&place, &PACKAGES)?;
    let out = place.join("surfaces");
    if out.exists() {
        std::fs::remove_dir_all(&out).with_context(|| format!("cannot empty {}", out.display()))?;
    }
    let folder = out.display().to_string();
    let surfaces = options.surfaces.to_string();
    let program = ["--package", "toolpath", "--example", "judge_toolpath", "--"];
    let words = [
        &["run", "--quiet", "--release"],
        &program[..],
        &[&folder, FIRST_SEED, &surfaces, PLACES],
    ];
    shell::run("cargo", &words.concat())?;
    let check = "tests/judges/toolpath/check.py";
    shell::run(&python, &["-B", check, &folder, "--check"])?;
    let removal = "tests/judges/toolpath/removal.py";
    // What it compiles stays out of the tree.
    let cache = [("NUMBA_CACHE_DIR", place.join("numba").display().to_string())];
    shell::run_with(&python, &["-B", removal, &folder, "--check"], &cache)?;
    if options.linuxcnc {
        apt::need(&[("rs274", "linuxcnc-uspace")])?;
        let check = "tests/judges/toolpath/rs274_check.py";
        shell::run(&python, &[check, &folder])?;
    }
    Ok(())
}
