//! Figures 5 to 7 of Yoo, with like objects, and the page about them.

mod base;
#[path = "../../../../geometry/fill/tests/common/mod.rs"]
mod common;
mod contour;
mod objects;
mod page;
mod scene;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser};
use relief_surfaces::kept;

/// Fill holes as Yoo does, and write the page about them.
#[derive(Debug, Parser)]
#[command(name = "study-holes", version)]
struct Options {
    #[command(flatten)]
    what: What,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct What {
    /// Write the page, with its pictures beside it
    #[arg(long, value_name = "FILE")]
    write_paper: Option<PathBuf>,
    /// Compare the figures with those of this page, and fail where they differ
    #[arg(long, value_name = "FILE")]
    check_paper: Option<PathBuf>,
}

fn main() -> ExitCode {
    match study(&Options::parse().what) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-holes: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn study(what: &What) -> Result<()> {
    if let Some(path) = &what.write_paper {
        kept::write(path, page::page(true)?)?;
    }
    if let Some(path) = &what.check_paper {
        kept::check(path, &page::page(false)?.0)?;
    }
    Ok(())
}
