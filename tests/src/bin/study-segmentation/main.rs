//! Judges the segmentation by scenes drawn from seeds, whose true faces are known.
//!
//! ```sh
//! cargo xtask study segmentation --set tune --only polyhedral
//! cargo xtask study segmentation --scene 17 --only abw --pictures pictures
//! ```

mod material;
mod methods;
mod pictures;
mod report;
mod tally;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Parser, ValueEnum};
use rayon::prelude::*;
use relief_tests::scenes::{Purpose, Set, View};

use crate::material::Store;
use crate::methods::Method;
use crate::tally::{Finding, Tally};

/// Score the segmentation on scenes whose true faces are known
#[derive(Debug, Parser)]
#[command(name = "study-segmentation", version)]
struct Options {
    /// Scenes to look at while tuning, or those for figures only
    #[arg(long = "set", value_enum, default_value = "tune")]
    purpose: PurposeName,
    /// The first few scenes of each set only
    #[arg(long)]
    short: bool,
    /// One set only
    #[arg(long, value_enum)]
    only: Option<SetName>,
    /// One scene only, by its seed
    #[arg(long, value_name = "SEED")]
    scene: Option<u64>,
    /// How the scenes are scanned
    #[arg(long, value_enum, default_value = "plain")]
    view: ViewName,
    /// Write truth and labels side by side as PNG files into this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Fail unless the bars hold
    #[arg(long)]
    check: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PurposeName {
    Tune,
    Judge,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetName {
    Polyhedral,
    Curved,
    Abw,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ViewName {
    Plain,
    Outliers,
    Mirrored,
    HalfPitch,
    OtherSeed,
    Cluttered,
}

impl Options {
    fn sets(&self) -> Vec<Set> {
        let only = self.only.map(|set| match set {
            SetName::Polyhedral => Set::Polyhedral,
            SetName::Curved => Set::Curved,
            SetName::Abw => Set::Abw,
        });
        Set::ALL
            .into_iter()
            .filter(|set| only.is_none_or(|o| o == *set))
            .collect()
    }

    fn seeds(&self, set: Set) -> Vec<u64> {
        /// Scenes of each set in the short form.
        const SHORT: usize = 4;
        let purpose = match self.purpose {
            PurposeName::Tune => Purpose::Tune,
            PurposeName::Judge => Purpose::Judge,
        };
        let seeds = set.seeds(purpose);
        match self.scene {
            Some(seed) => vec![seed],
            None if self.short => seeds.take(SHORT).collect(),
            None => seeds.collect(),
        }
    }

    fn view(&self) -> View {
        match self.view {
            ViewName::Plain => View::Plain,
            ViewName::Outliers => View::Outliers,
            ViewName::Mirrored => View::Mirrored,
            ViewName::HalfPitch => View::HalfPitch,
            ViewName::OtherSeed => View::OtherSeed,
            ViewName::Cluttered => View::Cluttered,
        }
    }
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("study-segmentation: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Whether everything that was checked holds.
fn run(options: &Options) -> Result<bool> {
    let store = Store::open()?;
    let view = options.view();
    if let Some(folder) = &options.pictures {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let mut holds = true;
    for set in options.sets() {
        let findings: Vec<Vec<Finding>> = options
            .seeds(set)
            .into_par_iter()
            .map(|seed| {
                let (subject, images) = store.get(set, seed, &[view])?;
                let image = images.first().context("no range image")?;
                let labels = methods::all(&subject, image, view)?;
                if let Some(folder) = &options.pictures {
                    pictures::write(folder, &subject, image, view, &labels)?;
                }
                Ok(labels
                    .iter()
                    .map(|labelled| tally::judge(&subject, image, view, labelled))
                    .collect())
            })
            .collect::<Result<_>>()?;
        let tallies: Vec<Tally> = Method::OURS
            .iter()
            .map(|method| Tally::of(set, *method, findings.iter().flatten()))
            .collect();
        report::print(set, view, &tallies, &findings);
        if options.check {
            holds &= report::check(set, view, &tallies);
        }
    }
    Ok(holds)
}
