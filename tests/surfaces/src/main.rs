//! B-spline surfaces measured: the placements of knots beside each other on surfaces in closed
//! form and on a recorded scan, and the experiments of Koo & Lee done again.
//!
//! ```sh
//! cargo xtask study surfaces --short
//! cargo xtask reproduce
//! ```

mod bound;
// Surfaces in closed form, as in the crate's own tests.
#[allow(dead_code, reason = "shared with tests; one is not measured here")]
#[path = "../../../geometry/surfacing/tests/common/mod.rs"]
mod common;
mod lines;
mod paper;
mod picture;
mod placements;
mod told;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use relief_surfaces::kept;

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
    /// Measure only surfaces whose name has this in it; `lines`, `fairing`: only that
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
        return kept::write(path, paper::page()?);
    }
    if let Some(path) = &options.check_paper {
        return kept::check(path, &paper::page()?.0);
    }
    placements::measure(
        options.short,
        options.scan.as_deref(),
        options.only.as_deref(),
        options.data.as_deref(),
        options.write.as_deref(),
    )
}
