//! Scans of parts of known features, what is recognised on them, and what the judge says of it.
//!
//! ```sh
//! cargo xtask study features --short
//! cargo xtask study features --seeds 1..=300 --write
//! ```
//!
//! Parts and judges are Python with OpenCASCADE (`tests/judges/features`); what is judged is the
//! command `relief features` as it is delivered, from scan file to features and solid. The truth is
//! beside the scans, and the command is given the scans alone.

mod part;
mod reduction;
mod scan;
mod study;

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use relief_tests::seeds::parse_seeds;

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
        #[arg(required = true)]
        names: Vec<String>,
    },
    /// Make parts, scan them, recognise their features, have them judged, tell it in tables
    Judge(JudgeOptions),
}

#[derive(Debug, Args)]
pub(crate) struct JudgeOptions {
    /// A Python with OpenCASCADE
    #[arg(long, value_name = "FILE")]
    pub(crate) python: PathBuf,
    /// The command that is judged; default: that beside this program
    #[arg(long, value_name = "FILE")]
    pub(crate) relief: Option<PathBuf>,
    /// Where parts, scans and answers are kept
    #[arg(long, value_name = "DIR", default_value = "target/studies/features")]
    pub(crate) place: PathBuf,
    /// Random parts: 1..=300 is for judging, 1001..=1400 may be looked at in tuning
    #[arg(long, value_name = "A..=B", default_value = "1..=300", value_parser = parse_seeds)]
    pub(crate) seeds: RangeInclusive<u64>,
    /// Scans of the published part: 1..=50 is for judging, 101..=150 may be looked at in tuning
    #[arg(long, value_name = "A..=B", default_value = "1..=50", value_parser = parse_seeds)]
    pub(crate) published: RangeInclusive<u64>,
    /// Two scans of the published part, six random parts, no million points
    #[arg(long)]
    pub(crate) short: bool,
    /// The published part alone
    #[arg(long, conflicts_with_all = ["short", "write", "plain", "seeds"])]
    pub(crate) only_published: bool,
    /// The random parts also with this network, such as the paper's 9-15-6, and with the network's
    /// answer replaced by chance
    #[arg(long, value_name = "FILE")]
    pub(crate) plain: Option<PathBuf>,
    /// Write docs/studies/features.md instead of printing it
    #[arg(long, conflicts_with = "short")]
    pub(crate) write: bool,
    /// Write the published part's Table 3, too
    #[arg(long, value_name = "FILE")]
    pub(crate) table: Option<PathBuf>,
    /// Fail if a figure is beyond its bar
    #[arg(long)]
    pub(crate) check: bool,
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
        What::Scan { folder, names } => scan::all(folder, names),
        What::Judge(options) => study::run(options),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Options::command().debug_assert();
    }
}
