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
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Parser;
use rayon::prelude::*;

use crate::check::Extent;
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
    /// Only the first seed's scans, and the figures that are of it
    #[arg(long, requires = "check", conflicts_with_all = ["write", "print", "data"])]
    short: bool,
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
    let (seeds, extent) = if options.short {
        (*SEEDS.start()..=*SEEDS.start(), Extent::FirstSeed)
    } else {
        (SEEDS, Extent::All)
    };
    let (results, firsts) = measure(seeds)?;
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
        let differences = check::differences(&committed, &page, extent);
        if !differences.is_empty() {
            bail!(
                "{} differs; `cargo xtask reproduce` writes it anew:\n  {}",
                path.display(),
                differences.join("\n  ")
            );
        }
        let which = match extent {
            Extent::All => "every figure",
            Extent::FirstSeed => "every figure of the first seed",
        };
        println!("{}: {which} holds", path.display());
    }
    Ok(())
}

/// All figures of these seeds, and the first one's runs. Those come first and alone, for their times.
fn measure(seeds: RangeInclusive<u64>) -> Result<(Results, Vec<Run>)> {
    let mut firsts = Vec::new();
    for subject in Subject::ALL {
        let scan = Scan::take(subject, *seeds.start())?;
        for method in ROADS {
            firsts.push(run(&scan, method, 1)?);
        }
    }
    let others: Vec<(Subject, u64)> = Subject::ALL
        .into_iter()
        .flat_map(|subject| seeds.clone().skip(1).map(move |seed| (subject, seed)))
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
        upright: upright::measure(seeds)?,
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
