//! Random parts of known faces, scanned and made into models, against what they really are.
//!
//! ```sh
//! cargo xtask study parts --seeds 201..=210
//! ```
//!
//! Parts and their truth come from OpenCASCADE (`tests/judges/parts`); the truth is read here,
//! beside the code under test, and never given to it.

mod bars;
mod bound;
mod edges;
mod grid;
mod judge;
mod list;
mod measure;
mod numbers;
mod page;
mod part;
mod quality;
mod regular;
mod scan;
mod surface;
mod tables;
mod trims;
mod truth_grid;

use std::collections::VecDeque;
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use deliverables::{CadOptions, write_iges, write_step};
use jiff::Timestamp;
use pipeline::{Regularize, RegularizeSettings, Settings, SmoothJoins};
use relief_tests::seeds::parse_seeds;

use crate::judge::Python;
use crate::measure::{Measured, measure};
use crate::part::Part;

/// Hold the models of random parts of known faces against the parts
#[derive(Debug, Parser)]
#[command(name = "study-parts", version)]
struct Options {
    /// A Python with OpenCASCADE, which makes parts that are not there and judges models
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
    /// Also have Gmsh mesh the models; the Python must have it
    #[arg(long, requires = "python")]
    gmsh: bool,
    /// The folder of the parts: SEED.stl and SEED.json
    #[arg(long, value_name = "DIR", default_value = "target/studies/parts")]
    parts: PathBuf,
    /// The folder for IGES and STEP files of the models
    #[arg(
        long,
        value_name = "DIR",
        default_value = "target/studies/parts/models"
    )]
    models: PathBuf,
    /// The parts, from the first seed to the last: 101..=160 is for figures, 201 and up may be
    /// looked at in tuning
    #[arg(long, value_name = "A..=B", default_value = "101..=160", value_parser = parse_seeds)]
    seeds: RangeInclusive<u64>,
    /// List every face that is not as it should be
    #[arg(long)]
    list: bool,
    /// Leave regions whole whose surfaces join smoothly
    #[arg(long, conflicts_with = "write")]
    keep: bool,
    /// Give the shapes the regularities that they are likely to have; has a page of its own
    #[arg(long)]
    regularize: bool,
    /// The first six parts only
    #[arg(long)]
    short: bool,
    /// Write the page about the study instead of printing it
    #[arg(long)]
    write: bool,
    /// Fail if a figure of the page that holds there does not any more
    #[arg(long, conflicts_with_all = ["write", "keep", "short", "seeds"], requires = "gmsh")]
    check: bool,
}

impl Options {
    /// What is done otherwise than the service does it.
    fn change(&self, settings: &mut Settings) {
        if self.keep {
            settings.smooth_joins = SmoothJoins::Keep;
        }
        if self.regularize {
            settings.regularize = Regularize::On(RegularizeSettings::default());
        }
    }

    /// The page about the study.
    fn page(&self) -> &'static str {
        if self.regularize { REGULAR } else { PAGE }
    }
}

/// Parts of a short study.
const SHORT: usize = 6;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/studies/parts.md");
const REGULAR: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../docs/studies/parts-regularized.md"
);

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-parts: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let most = if options.short { SHORT } else { usize::MAX };
    let seeds: Vec<u64> = options.seeds.clone().take(most).collect();
    let (Some(first), Some(last)) = (seeds.first(), seeds.last()) else {
        bail!("no seeds");
    };
    let page = options.page();
    // Before the work, which is long.
    let before = if options.check {
        Some(fs::read_to_string(page).with_context(|| {
            format!("cannot read {page}; `--write` in place of `--check` makes it")
        })?)
    } else {
        None
    };
    let python = options.python.clone().map(Python);
    if let Some(python) = &python {
        python.make(&options.parts, &seeds)?;
    }
    fs::create_dir_all(&options.models).with_context(|| options.models.display().to_string())?;
    let (parts, failed) = all(options, &seeds)?;
    for (seed, why) in &failed {
        eprintln!("part {seed}: {why}");
    }
    let judged = match &python {
        Some(python) => {
            let made: Vec<u64> = parts.iter().map(|part| part.seed).collect();
            let mut judged = python.judge(&options.models, &made)?;
            if options.gmsh {
                python.mesh(&options.models, &mut judged)?;
            }
            Some(judged)
        }
        None => None,
    };
    if options.list {
        print!("{}", list::list(&parts));
    }
    let text = page::page(
        &(*first..=*last),
        &parts,
        &failed,
        judged.as_deref(),
        options.regularize,
    );
    if options.write {
        return fs::write(page, text).context(page);
    }
    print!("{text}");
    if let Some(before) = before {
        let bars = page::bars(&parts, judged.as_deref());
        let lost = bars::lost(&before, &bars);
        ensure!(
            lost.is_empty() && failed.is_empty(),
            "parts without a model: {}; figures that held and do not any more: {}",
            failed.len(),
            lost.join("; ")
        );
    }
    Ok(())
}

/// A part that gave no model, and why.
pub(crate) type Failed = (u64, String);

/// All parts in the order of their seeds, worked on by as many threads as there are processors.
fn all(options: &Options, seeds: &[u64]) -> Result<(Vec<Measured>, Vec<Failed>)> {
    let open = Mutex::new(seeds.iter().copied().collect::<VecDeque<_>>());
    let next = || {
        open.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop_front()
    };
    let work = || {
        let mut done = Vec::new();
        while let Some(seed) = next() {
            let measured = one(options, seed);
            if let Ok(measured) = &measured {
                eprintln!(
                    "part {seed}: scanned in {:.1} s, model in {:.1} s",
                    measured.scan_s, measured.process_s
                );
            }
            done.push((seed, measured));
        }
        done
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut done: Vec<(u64, Result<Measured>)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().flat_map(|worker| worker.join());
        done.flatten().collect()
    });
    ensure!(done.len() == seeds.len(), "a part was lost to a panic");
    done.sort_by_key(|(seed, _)| *seed);
    let (mut parts, mut failed) = (Vec::new(), Vec::new());
    for (seed, measured) in done {
        match measured {
            Ok(measured) => parts.push(measured),
            Err(error) => failed.push((seed, format!("{error:#}"))),
        }
    }
    ensure!(!parts.is_empty(), "no part could be measured: {failed:?}");
    Ok((parts, failed))
}

fn one(options: &Options, seed: u64) -> Result<Measured> {
    let part = Part::read(&options.parts, seed)?;
    let measured = measure(&part, |settings| options.change(settings))?;
    write_models(&options.models, &measured)?;
    Ok(measured)
}

fn write_models(folder: &Path, measured: &Measured) -> Result<()> {
    let model = &measured.outcome.reconstruction.model;
    let (name, cad) = (format!("part-{}", measured.seed), CadOptions::default());
    let (mut iges, mut step) = (Vec::new(), Vec::new());
    write_iges(model, &name, Timestamp::UNIX_EPOCH, &cad, &mut iges)?;
    write_step(model, &name, Timestamp::UNIX_EPOCH, &cad, &mut step)?;
    let mask = serde_json::to_vec(&measured.mask)?;
    for (ending, bytes) in [("igs", iges), ("step", step), ("mask.json", mask)] {
        let file = folder.join(format!("{}.{ending}", measured.seed));
        fs::write(&file, bytes).with_context(|| file.display().to_string())?;
    }
    Ok(())
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
