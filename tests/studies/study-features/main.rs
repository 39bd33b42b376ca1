//! Scans of parts of known features, what is recognised on them, and what the judge says of it.
//!
//! ```sh
//! cargo xtask study features --seeds 1..=300
//! ```

mod part;
mod scan;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

/// Hold recognised machining features against what parts really have
#[derive(Debug, Parser)]
#[command(name = "study-features", version)]
struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Scan parts of a folder: NAME.stl and NAME.json become NAME.scan
    Scan {
        /// The folder of the parts
        folder: PathBuf,
        /// The parts
        names: Vec<String>,
        /// Leave scans that are there
        #[arg(long)]
        keep: bool,
    },
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-features: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    match &options.what {
        What::Scan {
            folder,
            names,
            keep,
        } => {
            for name in names {
                if *keep && folder.join(format!("{name}.seen.json")).exists() {
                    continue;
                }
                let seen = scan::scan(folder, name).with_context(|| format!("part {name}"))?;
                println!(
                    "{name}: {} samples, {} of the part, {} of the table",
                    seen.samples, seen.on_part, seen.on_table
                );
            }
            Ok(())
        }
    }
}
