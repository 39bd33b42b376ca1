//! Outlines of simulated scans over many seeds, without wire and service: how far the trim
//! loops lie from the true ones, in pitches.
//!
//! ```sh
//! cargo xtask study outline --object cylinder --seeds 40
//! ```

use std::process::ExitCode;
use std::thread;

use anyhow::{Result, ensure};
use clap::Parser;
use relief_tests::outline::{Outlines, measure};
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::preset::Overrides;

/// Measure the outlines of simulated scans over many seeds
#[derive(Debug, Parser)]
#[command(name = "study-outline", version)]
struct Options {
    /// What stands on the table: house or cylinder
    #[arg(long, default_value = "cylinder")]
    object: Object,
    /// The first seed; lower ones than the default were looked at in tuning
    #[arg(long, value_name = "N", default_value_t = 101)]
    first_seed: u64,
    /// How many seeds
    #[arg(long, value_name = "N", default_value_t = 40)]
    seeds: u64,
    /// Range noise at normal incidence (1 sigma), mm
    #[arg(long, value_name = "S")]
    noise_mm: Option<f64>,
    /// Fail if an outline is off by more than this, pitches
    #[arg(long, value_name = "P", default_value_t = 1.0)]
    within_pitches: f64,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-outline: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let seeds: Vec<u64> = (options.first_seed..options.first_seed + options.seeds).collect();
    ensure!(!seeds.is_empty(), "no seeds");
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let chunk = seeds.len().div_ceil(threads);
    let results: Vec<(u64, Result<Outlines>)> = thread::scope(|scope| {
        let workers: Vec<_> = seeds
            .chunks(chunk)
            .map(|seeds| {
                scope.spawn(move || -> Vec<_> {
                    seeds
                        .iter()
                        .map(|&seed| (seed, measure(&config(options, seed))))
                        .collect()
                })
            })
            .collect();
        let done = workers.into_iter().flat_map(|worker| worker.join());
        done.flatten().collect()
    });
    println!("seed   worst  outward/inward by face, pitches (vertices), place of the worst, mm");
    let (mut worst, mut failed) = (Vec::new(), 0);
    for (seed, outlines) in results {
        match outlines {
            Ok(outlines) => {
                print_row(seed, &outlines);
                worst.push(outlines.worst_pitches());
            }
            Err(error) => {
                println!("{seed:<5} {error:#}");
                failed += 1;
            }
        }
    }
    worst.sort_by(f64::total_cmp);
    let over = worst
        .iter()
        .filter(|w| **w > options.within_pitches)
        .count();
    if let (Some(median), Some(most)) = (worst.get(worst.len() / 2), worst.last()) {
        println!("median {median:.2}, worst {most:.2}, {over} over the bound, {failed} failed");
    }
    ensure!(
        over + failed == 0,
        "{over} scans beyond {} pitches, {failed} without a result",
        options.within_pitches
    );
    Ok(())
}

fn config(options: &Options, seed: u64) -> SimConfig {
    SimConfig {
        object: options.object.clone(),
        overrides: Overrides {
            noise_mm: options.noise_mm,
            ..Overrides::default()
        },
        seed,
        ..SimConfig::default()
    }
}

fn print_row(seed: u64, outlines: &Outlines) {
    print!("{seed:<5} {:>6.2} ", outlines.worst_pitches());
    let mut worst: Option<(f64, [f64; 2])> = None;
    for face in &outlines.faces {
        print!(
            " {:.2}/{:.2} ({})",
            face.outward_pitches, face.inward_pitches, face.vertices
        );
        if worst.is_none_or(|(most, _)| face.worst_pitches() > most) {
            worst = Some((face.worst_pitches(), face.worst_mm));
        }
    }
    if let Some((_, [x, y])) = worst {
        print!("  at {x:.1}, {y:.1}");
    }
    if outlines.unsmoothed_borders > 0 {
        print!("  {} unsmoothed", outlines.unsmoothed_borders);
    }
    println!();
}
