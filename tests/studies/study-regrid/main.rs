//! Judges the regridder by a tilted plane pair with a step, among outliers.
//!
//! ```sh
//! cargo xtask study regrid
//! cargo xtask study regrid --short
//! ```

mod bars;
mod figures;
mod oracle;
mod peers;
mod report;
mod scene;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use range_image::Unmonitored;
use regrid::{Estimator, RegridSettings, regrid};

use crate::figures::Figures;
use crate::scene::{COLUMNS, Outliers, PITCH_MM, SAMPLES, Scene};

/// Score the regridder on a plane pair with a step, among outliers
#[derive(Debug, Parser)]
#[command(name = "study-regrid", version)]
struct Options {
    /// One scan of a few cases, without peers or table; fails where a bar is missed
    #[arg(long)]
    short: bool,
    /// The scans looked at while tuning, not those for figures, by consensus alone; no table
    /// is written
    #[arg(long)]
    tune: bool,
    /// The ten scans from this seed on, by consensus alone; no table is written
    #[arg(long, value_name = "SEED", conflicts_with_all = ["short", "tune"])]
    first: Option<u64>,
    /// Outliers of one kind only; no table is written
    #[arg(long, value_name = "KIND")]
    only: Option<String>,
    /// Name every node on neither plane, on the wrong one or far off, and every hole
    #[arg(long)]
    list: bool,
    /// Leave out what other programs make of the same samples
    #[arg(long)]
    no_peers: bool,
    /// Where the table goes
    #[arg(long, value_name = "FILE", default_value = "docs/studies/regrid.md")]
    out: PathBuf,
}

/// What was measured of one estimator in one case.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) outliers: Outliers,
    pub(crate) share: f64,
    pub(crate) figures: Figures,
    pub(crate) nodes_per_s: f64,
}

const CASES: [(Outliers, &[f64]); 3] = [
    (Outliers::Uniform, &[0.0, 0.02, 0.1, 0.2, 0.3, 0.45]),
    (Outliers::OneSided, &[0.02, 0.1, 0.2, 0.3]),
    (Outliers::Clustered, &[0.02, 0.1, 0.2, 0.3]),
];
const SHORT_CASES: [(Outliers, &[f64]); 3] = [
    (Outliers::Uniform, &[0.0, 0.1, 0.3]),
    (Outliers::OneSided, &[0.3]),
    (Outliers::Clustered, &[0.3]),
];
/// The one scan that peers see: they take long.
const PEER_SEED: u64 = 101;
/// Samples that a peer is given for each node.
pub(crate) const PEER_NEIGHBOURS: usize = 49;

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-regrid: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let cases = if options.short { SHORT_CASES } else { CASES };
    let seeds = match (options.first, options.short, options.tune) {
        (Some(first), _, _) => first..=first.saturating_add(9),
        (None, true, false) => 101..=101,
        (None, true, true) => 1..=1,
        (None, false, true) => 1..=10,
        (None, false, false) => 101..=110,
    };
    let ours_alone = options.short || options.tune || options.first.is_some();
    let estimators: &[(&str, Estimator)] = if ours_alone {
        &[("consensus", Estimator::Consensus)]
    } else {
        &[
            ("consensus", Estimator::Consensus),
            ("least median", Estimator::LeastMedian),
            ("least squares", Estimator::LeastSquares),
        ]
    };
    let peers = if options.short || options.first.is_some() || options.no_peers {
        None
    } else {
        Some(peers::Python::ready()?)
    };
    let mut lines = Vec::new();
    let only = options.only.as_deref();
    for (outliers, shares) in cases {
        if only.is_some_and(|only| only != outliers.name()) {
            continue;
        }
        for &share in shares {
            for &(name, estimator) in estimators {
                let line = ours(
                    name,
                    estimator,
                    seeds.clone(),
                    outliers,
                    share,
                    options.list,
                )?;
                println!("{}", report::row(&line));
                lines.push(line);
            }
            let line = oracle::line(seeds.clone(), outliers, share);
            println!("{}", report::row(&line));
            lines.push(line);
            if let Some(python) = &peers {
                let scene = Scene {
                    seed: if options.tune { 1 } else { PEER_SEED },
                    outliers,
                    share,
                };
                for line in python.lines(&scene)? {
                    println!("{}", report::row(&line));
                    lines.push(line);
                }
            }
        }
    }
    let missed = bars::missed(&lines);
    if !ours_alone && only.is_none() {
        let text = report::page(&lines, &seeds, &missed, peers.as_ref());
        if let Some(folder) = options.out.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(&options.out, text)
            .with_context(|| format!("cannot write {}", options.out.display()))?;
        println!("written to {}", options.out.display());
    }
    for target in &missed {
        println!("target missed: {target}");
    }
    let broken = bars::broken(&lines);
    ensure!(broken.is_empty(), "bars broken:\n  {}", broken.join("\n  "));
    println!("every bar holds");
    Ok(())
}

/// One of our estimators on a case, over all seeds.
fn ours(
    name: &str,
    estimator: Estimator,
    seeds: impl Iterator<Item = u64>,
    outliers: Outliers,
    share: f64,
    list: bool,
) -> Result<Line> {
    let mut figures = Figures::default();
    let (mut nodes, mut seconds) = (0, 0.0);
    for seed in seeds {
        let scene = Scene {
            seed,
            outliers,
            share,
        };
        let settings = RegridSettings {
            threads: 1,
            ..RegridSettings::with_pitch(PITCH_MM).with_estimator(estimator)
        };
        let columns = scene.columns();
        let begun = Instant::now();
        let image = regrid(columns, &settings, &Unmonitored)?;
        seconds += begun.elapsed().as_secs_f64();
        nodes += image.valid_nodes();
        let told = figures.add(&image, &scene.truth(), extent_mm());
        if list {
            for node in told {
                println!(
                    "{} {:.0} % seed {seed}: {node}",
                    outliers.name(),
                    100.0 * share
                );
            }
        }
    }
    Ok(Line {
        name: name.to_owned(),
        outliers,
        share,
        figures,
        nodes_per_s: nodes as f64 / seconds,
    })
}

/// Width and height of the field of nodes that are asked for.
pub(crate) fn extent_mm() -> (f64, f64) {
    (
        PITCH_MM * f64::from(COLUMNS - 1),
        PITCH_MM * f64::from(SAMPLES - 1),
    )
}
