//! What other programs make of the same tasks, measured in one run with ours.

use anyhow::Result;
use clap::{Args, Subcommand};

use crate::{judge, shell};

/// Hold a command against other programs.
#[derive(Debug, Subcommand)]
pub(crate) enum Peers {
    /// `relief skin` against SciPy's FITPACK and geomdl, on torsos and recorded scans; OpenCASCADE
    /// measures the files.
    Skin(Options),
}

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// One body of each kind.
    #[arg(long)]
    pub(crate) short: bool,
}

/// Packages beside the judge's own, pinned as these are.
const SKIN: [&str; 2] = ["scipy==1.17.1", "geomdl==5.4.0"];

pub(crate) fn run(peers: &Peers) -> Result<()> {
    match peers {
        Peers::Skin(options) => skin(options),
    }
}

fn skin(options: &Options) -> Result<()> {
    let target = shell::root().join("target");
    let python = judge::python(&target.join("judges"), &SKIN)?;
    shell::run("cargo", &["build", "--release", "--bin", "relief"])?;
    let program = target.join("release/relief").display().to_string();
    let out = target.join("studies/skin").display().to_string();
    let mut words = vec!["-B", "tests/judges/skin/check.py", &program, "--out", &out];
    let data = shell::root().join("../shared/data");
    let data = data.display().to_string();
    words.extend(["--data", &data]);
    words.extend(options.short.then_some("--short"));
    shell::run(&python, &words)
}
