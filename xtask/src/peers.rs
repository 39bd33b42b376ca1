//! What other programs make of the same tasks, measured in one run with ours.

use std::fs;

use anyhow::{Context, Result};
use clap::{Args, Subcommand};

use crate::{instructions, judge, shell};

/// Hold a command against other programs.
#[derive(Debug, Subcommand)]
pub(crate) enum Peers {
    /// `relief skin` against SciPy's FITPACK and geomdl, on torsos and recorded scans; OpenCASCADE
    /// measures the files.
    Skin(Options),
    /// Medians in the cells of a grid by SciPy and Verde against the regridder, on a million samples
    /// without and with outliers.
    Regrid(RegridOptions),
    /// `relief surface` against FITPACK on a grid with an oblique step.
    Step,
}

#[derive(Debug, Args)]
pub(crate) struct RegridOptions {
    /// Write the table into docs/performance.md, too.
    #[arg(long)]
    pub(crate) write: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// One body of each kind.
    #[arg(long)]
    pub(crate) short: bool,
}

/// Packages beside the judge's own, pinned as these are.
const SKIN: [&str; 2] = [judge::SCIPY, "geomdl==5.4.0"];
const REGRID: [&str; 3] = [judge::SCIPY, "verde==1.9.0", "pandas==3.1.1"];

/// Shares of outliers among the samples to be regridded.
const OUTLIERS: [&str; 2] = ["0", "0.4"];
const PAGE: &str = "docs/performance.md";
/// Where the page has the table.
const MARKS: [&str; 2] = ["<!-- peers -->\n", "<!-- /peers -->"];

pub(crate) fn run(peers: &Peers) -> Result<()> {
    match peers {
        Peers::Skin(options) => skin(options),
        Peers::Regrid(options) => regrid(options),
        Peers::Step => step(),
    }
}

fn regrid(options: &RegridOptions) -> Result<()> {
    let target = shell::root().join("target");
    let python = judge::python(&target.join("judges"), &REGRID)?;
    let bench = instructions::build()?;
    let mut words = vec!["-B".to_owned(), "tests/peers/grid_medians.py".to_owned()];
    for outliers in OUTLIERS {
        let place = target.join("studies/regrid-peers").join(outliers);
        let folder = place.display().to_string();
        shell::run(&bench, &["--scattered", &folder, "--outliers", outliers])?;
        words.push(folder);
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let table = shell::output(&python, &words)?;
    print!("{table}");
    if options.write {
        write(&table).with_context(|| format!("cannot write {PAGE}"))?;
    }
    Ok(())
}

fn step() -> Result<()> {
    let target = shell::root().join("target");
    let python = judge::python(&target.join("judges"), &[judge::SCIPY])?;
    shell::run("cargo", &["build", "--release", "--bin", "relief"])?;
    let program = shell::target().join("release/relief").display().to_string();
    let folder = target.join("studies/step").display().to_string();
    shell::run(
        &python,
        &["-B", "tests/peers/step_surface.py", &program, &folder],
    )
}

/// Puts a table where the page's marks are.
fn write(table: &str) -> Result<()> {
    let page = shell::root().join(PAGE);
    let text = fs::read_to_string(&page)?;
    let [begin, end] = MARKS;
    let parts = text
        .split_once(begin)
        .and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    let (before, after) = parts.context("the page has no marks for the table")?;
    fs::write(&page, format!("{before}{begin}{table}{end}{after}"))?;
    Ok(())
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
