//! The experiments of Shim & Lee 1995 on the simulated cylinder and house: scans them, takes
//! both roads, and writes the page with the paper's figures beside ours.
//!
//! ```sh
//! cargo xtask reproduce --check
//! ```

mod bars;
mod check;
mod conditions;
mod data;
mod experiment;
mod page;
mod regions;
mod results;
mod tables;
mod true_image;
mod upright;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Parser;
use rayon::prelude::*;

use crate::conditions::{SEEDS, Subject};
use crate::experiment::{Run, Scan, run};
use crate::results::{Entry, ROADS, Results};

/// Repeat the experiments of Shim & Lee 1995
#[derive(Debug, Parser)]
#[command(name = "study-reproduction", version)]
struct Options {
    /// Write the page
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Compare the figures with those of this page, and fail where they differ
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
    /// Print the part of the page whose heading has these words
    #[arg(long, value_name = "WORDS")]
    print: Option<String>,
    /// Leave what pictures are drawn from in this folder
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
}

fn main() -> ExitCode {
    match study(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-reproduction: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn study(options: &Options) -> Result<()> {
    let (results, firsts) = measure()?;
    let page = page::page(&results)?;
    if let Some(folder) = &options.data {
        for subject in Subject::ALL {
            let runs: Vec<&Run> = firsts.iter().filter(|r| r.subject == subject).collect();
            data::write(folder, subject, &runs)?;
        }
    }
    if let Some(words) = &options.print {
        print!("{}", page::section(&page, words)?);
    }
    if let Some(path) = &options.write {
        fs::write(path, &page).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {}", path.display());
    }
    if let Some(path) = &options.check {
        let committed =
            fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let differences = check::differences(&committed, &page);
        if !differences.is_empty() {
            bail!(
                "{} differs; `cargo xtask reproduce` writes it anew:\n  {}",
                path.display(),
                differences.join("\n  ")
            );
        }
        println!("{}: every figure holds", path.display());
    }
    Ok(())
}

/// All figures, and the first seed's runs. Those come first and alone, for their times.
fn measure() -> Result<(Results, Vec<Run>)> {
    let mut firsts = Vec::new();
    for subject in Subject::ALL {
        let scan = Scan::take(subject, *SEEDS.start())?;
        for method in ROADS {
            firsts.push(run(&scan, method, 1)?);
        }
    }
    let others: Vec<(Subject, u64)> = Subject::ALL
        .into_iter()
        .flat_map(|subject| SEEDS.skip(1).map(move |seed| (subject, seed)))
        .collect();
    let runs: Vec<Vec<Entry>> = others
        .into_par_iter()
        .map(|(subject, seed)| {
            let scan = Scan::take(subject, seed)?;
            ROADS
                .into_iter()
                .map(|method| Ok(entry(&run(&scan, method, 1)?)))
                .collect()
        })
        .collect::<Result<_>>()?;
    let entries = firsts.iter().map(entry).chain(runs.into_iter().flatten());
    let results = Results {
        entries: entries.collect(),
        upright: upright::measure()?,
    };
    Ok((results, firsts))
}

fn entry(run: &Run) -> Entry {
    Entry {
        subject: run.subject,
        method: run.method,
        seed: run.seed,
        figures: run.figures.clone(),
    }
}
