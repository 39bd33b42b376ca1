//! How fast each stage is, beside peers measured in the same run.
//!
//! ```sh
//! cargo xtask bench
//! ```

mod floor;
mod large;
mod mlms;
mod row;
mod scan;
mod scattered;
mod stages;
mod timing;
mod work;

use std::alloc::System;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use regrid::with_threads;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

/// Counts allocations; two additions for each do not show in any time.
#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Measure how fast each stage is
#[derive(Debug, Parser)]
#[command(name = "bench", version)]
struct Options {
    /// Small sizes only
    #[arg(long)]
    short: bool,
    /// Only the kernel of MLMS, or only the stages of a scan
    #[arg(long, value_name = "NAME", value_parser = BENCHES.map(|(name, _)| name))]
    only: Option<String>,
    /// Do one piece of work and measure no time, for instructions to be counted: prints how many
    /// nodes it has each time, and how many blocks of memory the program has asked for
    #[arg(long, value_name = "NAME", value_parser = work::WORK.map(|(name, _)| name))]
    work: Option<String>,
    /// How many times the work is done
    #[arg(long, value_name = "TIMES", default_value_t = 1, requires = "work")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..))]
    times: u64,
    /// Print what the textbook of MLMS answers for so many windows, for others to be held against
    #[arg(long, value_name = "WINDOWS", conflicts_with = "work")]
    answers: Option<usize>,
    /// Regrid a million samples and write them and what was found into this folder, for peers
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["work", "answers"])]
    scattered: Option<PathBuf>,
    /// Share of these that are outliers
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.0,
        requires = "scattered"
    )]
    outliers: f64,
    /// How a scan of so many columns of as many samples fares on two threads: a row with nodes, seconds of
    /// regridding by MLMS, of segmenting, of all from the range image to the file, and the peak of memory in MB
    #[arg(long, value_name = "SIDE", conflicts_with_all = ["work", "answers", "scattered"])]
    #[arg(value_parser = clap::value_parser!(u32).range(64..=8192))]
    large: Option<u32>,
    /// Write the whole table into this page, too, between its marks
    #[arg(long, value_name = "FILE", conflicts_with_all = ["work", "answers", "only", "short", "large"])]
    write: Option<PathBuf>,
    /// Rows as JSON, one in a line, instead of a table
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench: {error:#}");
            ExitCode::FAILURE
        }
    }
}

type Bench = fn(bool) -> Result<Vec<row::Row>>;

const BENCHES: [(&str, Bench); 2] = [("mlms", mlms::rows), ("scan", stages::rows)];

fn run(options: &Options) -> Result<()> {
    if let Some(name) = &options.work {
        // How work is shared out among threads would be counted, too.
        let nodes = with_threads(1, || work::work(name, options.times))??;
        let told = ALLOCATOR.stats();
        println!("{nodes} {}", told.allocations + told.reallocations);
        return Ok(());
    }
    if let Some(number) = options.answers {
        return mlms::print_answers(number);
    }
    if let Some(folder) = &options.scattered {
        return scattered::write(folder, options.outliers);
    }
    if let Some(side) = options.large {
        return large::print(side);
    }
    if !options.json {
        println!("{}", row::HEAD);
    }
    let matches = |name: &str| options.only.as_ref().is_none_or(|only| only == name);
    let mut table = row::HEAD.to_owned();
    for (_, rows) in BENCHES.iter().filter(|(name, _)| matches(name)) {
        for row in rows(options.short)? {
            if options.json {
                println!("{}", serde_json::to_string(&row)?);
            } else {
                println!("{row}");
            }
            table.push_str(&format!("\n{row}"));
        }
    }
    if let Some(page) = &options.write {
        write(page, &table).with_context(|| format!("cannot write {}", page.display()))?;
    }
    Ok(())
}

const MARKS: [&str; 2] = ["<!-- bench -->\n", "<!-- /bench -->"];

/// Puts the table where the page's marks are.
fn write(page: &Path, table: &str) -> Result<()> {
    let text = fs::read_to_string(page)?;
    let parts = text
        .split_once(MARKS[0])
        .and_then(|(before, rest)| Some((before, rest.split_once(MARKS[1])?.1)));
    let (before, after) = parts.context("the page has no marks for the table")?;
    let [begin, end] = MARKS;
    fs::write(page, format!("{before}{begin}{table}\n{end}{after}"))?;
    Ok(())
}
