//! Scans under faults of every class and under mixes of them, with a table of how they ended.

mod page;
mod tally;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Parser;
use faults::{CLASSES, Class, class};
use tally::{Judge, Tally};

/// Scans under faults, in simulated time: the driver against the simulated device.
///
/// Every scan must end, with the laser off, and its journal must be that of a scan without
/// faults, byte for byte. Scans of classes that need nobody must end without a person; the
/// others must stop for the right cause, and go on when told to.
#[derive(Debug, Parser)]
#[command(name = "study-faults", version)]
struct Cli {
    /// Scans under mixes of faults
    #[arg(long, default_value_t = 2_000, value_name = "N")]
    mixes: u64,

    /// Scans under each class alone
    #[arg(long, default_value_t = 1_000, value_name = "N")]
    each: u64,

    /// First seed
    #[arg(long, default_value_t = 1_000, value_name = "N")]
    from: u64,

    /// Only this class, or mix
    #[arg(long, value_name = "CLASS")]
    only: Option<String>,

    /// Run one scan of --only and tell all about it
    #[arg(long, value_name = "SEED", requires = "only")]
    replay: Option<u64>,

    /// Write the page with the tables here
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("study-faults: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Whether every bar is met.
fn run(cli: &Cli) -> Result<bool> {
    let classes: Vec<&Class> = match cli.only.as_deref() {
        None => CLASSES.iter().collect(),
        Some("mix") => Vec::new(),
        Some(name) => vec![Class::named(name).with_context(|| format!("no class {name}"))?],
    };
    let mixes = cli.only.as_deref().is_none_or(|only| only == "mix");
    if let Some(seed) = cli.replay {
        return replay(classes.first().copied(), seed);
    }
    let judge = Judge::new()?;
    let start = Instant::now();
    let mut tallies: Vec<Tally> = classes
        .iter()
        .map(|class| {
            let seeds = cli.from..cli.from + cli.each;
            report(judge.many(class.name, Some(class), seeds, |seed| class.alone(seed)))
        })
        .collect();
    if mixes {
        let seeds = cli.from..cli.from + cli.mixes;
        tallies.push(report(
            judge.many("mix", None, seeds, |seed| class::mix(seed).0),
        ));
    }
    let good = tallies.iter().all(Tally::is_good);
    let table = page::table(&tallies);
    println!("\n{table}");
    println!("{:.0} s", start.elapsed().as_secs_f64());
    if let Some(path) = &cli.page {
        if cli.only.is_some() {
            bail!("the page has all classes: leave out --only");
        }
        fs::write(path, page::page(&tallies, cli.from)).context(path.display().to_string())?;
    }
    Ok(good)
}

fn report(tally: Tally) -> Tally {
    println!(
        "{:16} {} scans, {} struck, {} by themselves, {} with a person, {} excused, {} failed",
        tally.name,
        tally.scans,
        tally.struck,
        tally.alone,
        tally.attended,
        tally.excused,
        tally.failures.len()
    );
    for failure in tally.failures.iter().take(5) {
        println!("    {failure}");
    }
    tally
}

fn replay(class: Option<&Class>, seed: u64) -> Result<bool> {
    let conditions = match class {
        Some(class) => class.alone(seed),
        None => class::mix(seed).0,
    };
    println!("{conditions:#?}");
    let mut outcome = faults::run(&conditions)?;
    let bytes = outcome.journal.as_ref().map(Vec::len);
    outcome.journal = None;
    println!("{outcome:#?}\njournal: {bytes:?} bytes");
    Ok(bytes.is_some())
}
