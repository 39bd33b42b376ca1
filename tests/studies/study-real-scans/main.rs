//! Holds the models of recorded scans against the samples they were made from.
//!
//! ```sh
//! cargo xtask study real-scans                          # a table of all recordings
//! cargo xtask study real-scans --only bun000 --regions  # and one of each region
//! cargo xtask study real-scans --sheets 3                # simulated sheets, truth known
//! ```

mod files;
mod report;
mod residuals;
mod sheets;

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use deliverables::picture;
use pipeline::{Method, Outcome, Settings, process_columns};
use range_image::{RangeImage, Unmonitored};

use crate::residuals::{Residuals, residuals};

/// Hold the models of recorded scans against the samples they were made from
#[derive(Debug, Parser)]
#[command(name = "study-real-scans", version)]
struct Options {
    /// The folder of the recordings
    #[arg(long, value_name = "DIR", default_value = "../shared/data")]
    data: PathBuf,
    /// Only recordings with this in their path
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// The road from samples to surfaces: relief or shim-lee
    #[arg(long, value_name = "METHOD", default_value = "relief")]
    method: Method,
    /// A table of the regions of each recording, too
    #[arg(long)]
    regions: bool,
    /// Write the range image and the regions of each recording as PNG files into this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Write the table as a page
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Instead of recordings, fit this many scans of each simulated sheet, whose truth is
    /// known
    #[arg(long, value_name = "SCANS")]
    sheets: Option<u64>,
    /// Fail where the samples of a recording within its faces are farther from them along
    /// the normal, rms, or where there is none
    #[arg(long, value_name = "MM")]
    within_mm: Option<f64>,
    /// Fail where a smaller part of the samples lies within faces
    #[arg(long, value_name = "PERCENT")]
    coverage: Option<f64>,
}

fn main() -> ExitCode {
    match study(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-real-scans: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// A recording and what became of it.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) image: RangeImage,
    pub(crate) outcome: Outcome,
    /// Of all samples.
    pub(crate) all: Residuals,
    /// Of those within each face.
    pub(crate) each: Vec<Residuals>,
}

fn study(options: &Options) -> Result<()> {
    if let Some(seeds) = options.sheets {
        print!("{}", sheets::table(seeds)?);
        return Ok(());
    }
    let only = options.only.as_deref().unwrap_or_default();
    let mut files = files::all(&options.data)?;
    files.retain(|path| path.display().to_string().contains(only));
    ensure!(!files.is_empty(), "no recording has {only:?} in its path");
    let mut cases = Vec::new();
    for path in &files {
        cases.push(case(path, options).with_context(|| path.display().to_string())?);
    }
    print!("{}", report::table(&cases));
    if options.regions {
        for case in &cases {
            print!("\n{}", report::of_regions(case));
        }
    }
    if let Some(page) = &options.write {
        std::fs::write(page, report::page(&cases))
            .with_context(|| format!("cannot write {}", page.display()))?;
    }
    check(&cases, options)
}

fn case(path: &Path, options: &Options) -> Result<Case> {
    let recording = files::recording(path)?;
    let settings = Settings::new(recording.pitch_mm).with_method(options.method);
    let columns = recording.columns;
    let (image, outcome) = process_columns(&columns, &settings, &Unmonitored)?;
    let faces = &outcome.reconstruction.model.faces;
    let (all, each) = residuals(&columns, &image, &outcome.regions, faces);
    let name = files::name(path);
    if let Some(folder) = &options.pictures {
        pictures(folder, &name, &image, &outcome)?;
    }
    Ok(Case {
        name,
        image,
        outcome,
        all,
        each,
    })
}

fn pictures(folder: &Path, name: &str, image: &RangeImage, outcome: &Outcome) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let file = |what: &str| {
        let path = folder.join(format!("{name}-{what}.png"));
        let made = File::create(&path);
        made.with_context(|| format!("cannot write {}", path.display()))
    };
    picture::write_range(image, name, file("range")?)?;
    picture::write_regions(image, outcome, &[], name, file("regions")?)?;
    Ok(())
}

fn check(cases: &[Case], options: &Options) -> Result<()> {
    let within = options.within_mm.unwrap_or(f64::INFINITY);
    let coverage = options.coverage.unwrap_or(0.0) / 100.0;
    let failing = cases.iter().filter(|case| {
        let near = case.all.rms_mm() <= within || options.within_mm.is_none();
        !near || case.all.coverage() < coverage
    });
    let names: Vec<&str> = failing.map(|case| case.name.as_str()).collect();
    ensure!(
        names.is_empty(),
        "the bar does not hold for {}",
        names.join(", ")
    );
    Ok(())
}
