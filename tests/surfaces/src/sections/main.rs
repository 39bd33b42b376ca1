//! The tables and figures of Jo, Kwon & Han done again.
//!
//! ```sh
//! cargo xtask reproduce
//! ```

mod figures;
mod page;
mod torso;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser};
use relief_surfaces::kept;

/// Do the tables and figures of Jo, Kwon & Han again
#[derive(Debug, Parser)]
#[command(name = "study-sections", version)]
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
            eprintln!("study-sections: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn study(what: &What) -> Result<()> {
    if let Some(path) = &what.write_paper {
        kept::write(path, page::page()?)?;
    }
    if let Some(path) = &what.check_paper {
        kept::check(path, &page::page()?.0)?;
    }
    Ok(())
}
