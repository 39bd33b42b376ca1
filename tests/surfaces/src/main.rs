//! B-spline surfaces measured: the placements of knots beside each other on surfaces in closed
//! form and on a recorded scan, and the experiments of Koo & Lee done again.
//!
//! ```sh
//! cargo xtask study surfaces --short
//! cargo xtask reproduce
//! ```

// Surfaces in closed form, as in the crate's own tests.
mod bound;
#[allow(dead_code, reason = "shared with tests; one is not measured here")]
#[path = "../../../geometry/surfacing/tests/common/mod.rs"]
mod common;
mod paper;
mod picture;
mod placements;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Parser;

/// Measure B-spline surfaces
#[derive(Debug, Parser)]
#[command(name = "study-surfaces", version)]
struct Options {
    /// One tolerance each, smaller grids, no recorded scan
    #[arg(long)]
    short: bool,
    /// A recorded scan to be measured, too (PLY in metres)
    #[arg(long, value_name = "FILE")]
    scan: Option<PathBuf>,
    /// Measure only surfaces whose name has this in it; `fairing`: only that
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// Write what is measured to this page, too
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Leave grids and figures for the judge in this folder
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Write the page about the experiments of Koo & Lee, with its pictures beside it, instead
    #[arg(long, value_name = "FILE")]
    write_paper: Option<PathBuf>,
    /// Compare the figures with those of this page instead, and fail where they differ
    #[arg(long, value_name = "FILE")]
    check_paper: Option<PathBuf>,
}

fn main() -> ExitCode {
    match study(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-surfaces: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn study(options: &Options) -> Result<()> {
    if let Some(path) = &options.write_paper {
        let (page, pictures) = paper::page()?;
        for (name, picture) in pictures {
            let folder = path.parent().unwrap_or(path).join(paper::PICTURES);
            fs::create_dir_all(&folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
            fs::write(folder.join(name), picture)
                .with_context(|| format!("cannot write {name} into {}", folder.display()))?;
        }
        fs::write(path, page).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {}", path.display());
        return Ok(());
    }
    if let Some(path) = &options.check_paper {
        let kept =
            fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let (page, _) = paper::page()?;
        for (kept, now) in kept.lines().zip(page.lines()) {
            if kept != now {
                bail!(
                    "{} differs; `cargo xtask reproduce` writes it anew:\n  there: {kept}\n  now:   {now}",
                    path.display()
                );
            }
        }
        if kept.lines().count() != page.lines().count() {
            bail!("{} has another number of lines", path.display());
        }
        println!("{}: every figure holds", path.display());
        return Ok(());
    }
    placements::measure(
        options.short,
        options.scan.as_deref(),
        options.only.as_deref(),
        options.data.as_deref(),
        options.write.as_deref(),
    )
}
