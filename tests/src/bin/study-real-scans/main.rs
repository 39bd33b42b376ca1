//! Holds the models of recorded scans against the samples they were made from.
//!
//! ```sh
//! cargo xtask study real-scans                          # a table of all recordings
//! cargo xtask study real-scans --only bun000 --regions  # and one of each region
//! cargo xtask study real-scans --sheets 3            # simulated sheets, truth known
//! ```

mod files;
mod residuals;
mod sheets;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Parser;
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

/// The part of a scan's samples for which the model must hold.
const NEAREST: f64 = 0.97;

/// A recording and what became of it.
struct Case {
    name: String,
    image: RangeImage,
    outcome: Outcome,
    all: Residuals,
    each: Vec<Residuals>,
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
    print!("{}", table(&cases));
    if options.regions {
        for case in &cases {
            print!("\n{}", of_regions(case));
        }
    }
    check(&cases, options)
}

fn case(path: &Path, options: &Options) -> Result<Case> {
    let recording = files::recording(path)?;
    let settings = Settings::new(recording.pitch_mm).with_method(options.method);
    let columns = recording.columns;
    let (image, outcome) = process_columns(columns.iter().cloned(), &settings, &Unmonitored)?;
    let faces = &outcome.reconstruction.model.faces;
    let (all, each) = residuals(&columns, &image, &outcome.regions, faces);
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
    let name = name.unwrap_or_default();
    Ok(Case {
        name: name.split('.').next().unwrap_or(&name).to_owned(),
        image,
        outcome,
        all,
        each,
    })
}

fn table(cases: &[Case]) -> String {
    let mut text = String::from(
        "| recording | pitch, mm | samples | regions | faces | patches | samples within faces \
         | of these within three sigma | rms along the normal, mm | rms of the nearest 97 %, mm |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for case in cases {
        let reconstruction = &case.outcome.reconstruction;
        let patches: usize = reconstruction.regions.iter().map(|r| r.patches).sum();
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {:.1} % | {:.1} % | {:.3} | {:.3} |\n",
            case.name,
            case.image.pitch_mm(),
            case.all.samples,
            case.outcome.regions.regions(),
            reconstruction.model.faces.len(),
            patches,
            100.0 * case.all.coverage(),
            100.0 * case.all.near_share(),
            case.all.rms_mm(),
            case.all.rms_of_nearest_mm(NEAREST),
        );
    }
    text
}

fn of_regions(case: &Case) -> String {
    let mut text = format!(
        "{}\n\n| face | nodes | patches | rms of the nodes, mm | samples | within three sigma \
         | rms along the normal, mm |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        case.name
    );
    let reconstruction = &case.outcome.reconstruction;
    for (face, residuals) in reconstruction.model.faces.iter().zip(&case.each) {
        let mut fits = reconstruction.regions.iter();
        let Some(fit) = fits.find(|fit| fit.label == face.region) else {
            continue;
        };
        let reconstruct::Surface::Patches(surface) = &face.surface;
        text += &format!(
            "| {} | {} | {} | {:.3} | {} | {:.1} % | {:.3} |\n",
            face.name,
            fit.nodes,
            surface.patches.len(),
            fit.rms_mm,
            residuals.samples,
            100.0 * residuals.near_share(),
            residuals.rms_mm(),
        );
    }
    text
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
