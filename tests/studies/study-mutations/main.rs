//! Damaged scan files for every reader: no panic, no hang, no memory without bound.
//!
//! ```sh
//! cargo xtask study mutations --files 10000
//! cargo xtask study mutations --worst 16
//! ```

use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;
use peak_alloc::PeakAlloc;
use relief_tests::mutations::{self, Figures, MOST_BYTES, Meter, Wanted};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

struct Memory;

impl Meter for Memory {
    fn begin(&self) -> usize {
        ALLOCATOR.reset_peak_usage();
        ALLOCATOR.current_usage()
    }

    fn peak(&self) -> usize {
        ALLOCATOR.peak_usage()
    }
}

/// Read damaged scan files of every format with every reader
#[derive(Debug, Parser)]
#[command(name = "study-mutations", version)]
struct Options {
    /// How many files
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    files: u64,
    /// Number of the first file; the same number is the same file
    #[arg(long, value_name = "N", default_value_t = 1)]
    first: u64,
    /// Make models of every so many files that can be read; 0 for none
    #[arg(long, value_name = "N", default_value_t = 5)]
    through_every: u64,
    /// Write the file of this number to standard output, and end
    #[arg(long, value_name = "N")]
    show: Option<u64>,
    /// Instead: read files of so many megabytes that are made to take as long, and as much
    /// memory, as they can
    #[arg(long, value_name = "MB")]
    worst: Option<f64>,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-mutations: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    if let Some(number) = options.show {
        let mutant = mutations::mutant(&mutations::seeds()?, number)?;
        return Ok(std::io::Write::write_all(
            &mut std::io::stdout(),
            &mutant.bytes,
        )?);
    }
    if let Some(size_mb) = options.worst {
        return worst((size_mb * 1e6) as usize);
    }
    let wanted = Wanted {
        first: options.first,
        files: options.files,
        through_every: options.through_every,
    };
    let figures = mutations::run(&wanted, &Memory, |number| {
        if number % 1000 == 0 {
            eprintln!("file {number}");
        }
    })?;
    tell(&figures);
    ensure!(
        figures.panics.is_empty(),
        "{} files made a reader panic",
        figures.panics.len()
    );
    let (bytes, number) = figures.most_bytes;
    ensure!(
        bytes <= MOST_BYTES,
        "file {number} took {bytes} bytes of memory"
    );
    Ok(())
}

/// Reads the worst files of a size, and tells what each took.
fn worst(size: usize) -> Result<()> {
    println!(
        "{:<44} {:>7} {:>7} {:>8} READER THAT TOOK LONGEST, AND WHAT CAME OF IT",
        "FILE", "MB", "CPU S", "MB TAKEN"
    );
    let all = mutations::worst(size, &Memory, |one| {
        println!(
            "{:<44} {:>7.3} {:>7.2} {:>8.1} {}: {:.90}",
            one.name,
            one.bytes as f64 / 1e6,
            one.took.as_secs_f64(),
            one.peak_bytes as f64 / 1e6,
            one.reader,
            one.said
        );
    })?;
    for one in all {
        ensure!(
            one.peak_bytes <= MOST_BYTES,
            "{} took {} bytes of memory",
            one.name,
            one.peak_bytes
        );
    }
    Ok(())
}

fn tell(figures: &Figures) {
    println!("{:<28} {:>6} {:>6}", "DAMAGED FILES OF", "FILES", "READ");
    for (format, (files, taken)) in &figures.formats {
        println!("{format:<28} {files:>6} {taken:>6}");
    }
    let (went_on, models) = figures.through;
    println!("went on to a model: {went_on}, made: {models}");
    let (time, number) = figures.longest;
    println!("longest time: {:.2} s (file {number})", time.as_secs_f64());
    let (bytes, number) = figures.most_bytes;
    println!("most memory: {:.1} MB (file {number})", bytes as f64 / 1e6);
    for (number, said) in &figures.panics {
        println!("PANIC at file {number}: {said}");
    }
}
