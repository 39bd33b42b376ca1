//! The tables and figures of Jo, Kwon & Han done again.
//!
//! ```sh
//! cargo xtask reproduce
//! ```

mod figures;
mod page;
mod torso;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Parser};

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
        write(path)?;
    }
    if let Some(path) = &what.check_paper {
        check(path)?;
    }
    Ok(())
}

fn write(path: &Path) -> Result<()> {
    let (page, pictures) = page::page()?;
    let folder = path.parent().unwrap_or(path).join(page::PICTURES);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (name, picture) in pictures {
        let path = folder.join(name);
        fs::write(&path, picture).with_context(|| format!("cannot write {}", path.display()))?;
    }
    fs::write(path, page).with_context(|| format!("cannot write {}", path.display()))?;
    println!("written to {}", path.display());
    Ok(())
}

fn check(path: &Path) -> Result<()> {
    let kept =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let (page, _) = page::page()?;
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
    Ok(())
}
