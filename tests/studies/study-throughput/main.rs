//! How fast each way to the scanner is, who waits for whom, and what a slow disk does.
//!
//! ```sh
//! cargo xtask study throughput --short
//! cargo xtask study throughput --usb --page docs/studies/throughput.md
//! ```

mod disk;
mod page;
mod stream;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use scanner_driver::LinkSettings;
use throughput::{Attached, Case, Encoding, Row, TABLE_HEAD, fastest_of, memory, pseudo_terminal};

use sim_scanner::device::DeviceSettings;
use sim_scanner::source::Source;

/// Measure how fast each way to the scanner is, and what a slow disk does
#[derive(Debug, Parser)]
#[command(name = "study-throughput", version)]
struct Options {
    /// A tenth of the columns, and two disks only
    #[arg(long)]
    short: bool,
    /// Write the tables to this page
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// The table that the virtual machine printed, for the page
    #[arg(long, value_name = "FILE", hide = true)]
    usb_table: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-throughput: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let usb = options.usb_table.as_ref().map(|file| {
        std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
    });
    let ways = ways(options.short)?;
    let streams = stream::study(options.short)?;
    let disks = disk::study(options.short)?;
    if let Some(page) = &options.page {
        let usb = usb.context("the page needs --usb")??;
        std::fs::write(page, page::page(&usb, &ways, &streams, &disks))
            .with_context(|| format!("cannot write {}", page.display()))?;
    }
    Ok(())
}

/// Columns by samples of each.
const SIZES: [(u32, u32); 2] = [(256, 4000), (2000, 500)];

/// As fast as it goes, and as slow as a table with a spinning mirror.
const LINE_RATES_HZ: [Option<f64>; 2] = [None, Some(50.0)];

/// Scans of which the fastest counts.
const SCANS: u32 = 5;

/// Columns at a line rate, which the way has little part in.
const PACED_COLUMNS: u32 = 150;

type Way = (&'static str, fn(Source, DeviceSettings) -> Result<Attached>);

const WAYS: [Way; 2] = [("memory", memory), ("pseudo-terminal", pseudo_terminal)];

fn ways(short: bool) -> Result<Vec<Row>> {
    println!("{TABLE_HEAD}");
    let mut rows = Vec::new();
    for line_rate_hz in LINE_RATES_HZ {
        for (samples, columns) in SIZES {
            for encoding in [Encoding::Uniform, Encoding::Listed] {
                let columns = line_rate_hz.map_or(columns, |_| PACED_COLUMNS);
                let case = Case {
                    columns: if short { columns / 10 } else { columns },
                    samples,
                    encoding,
                    line_rate_hz,
                };
                let source = case.source()?;
                for (way, attach) in WAYS {
                    // As many columns in flight as the simulator keeps.
                    let link = LinkSettings {
                        credits: 64,
                        ..LinkSettings::default()
                    };
                    // A line rate leaves nothing to choose from.
                    let scans = if line_rate_hz.is_some() { 1 } else { SCANS };
                    let row = fastest_of(scans, way, (&case, &source), &link, attach)?;
                    println!("{row}");
                    rows.push(row);
                }
            }
        }
    }
    Ok(rows)
}
