//! The skinning itself.

use std::path::{Path, PathBuf};

use cad_exchange::iges::NamedSurface;
use deliverables::{Entities, SkinFigures, skin_pictures, write_atomically};
use serde::Serialize;
use skin::{Skin, SkinError};

use super::{Args, read, summary};
use crate::command::places;
use crate::command::shown::{self, Shown};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints, and the report holds.
#[derive(Debug, Serialize)]
pub(super) struct Skinned {
    pub(super) output: PathBuf,
    #[serde(flatten)]
    pub(super) figures: SkinFigures,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) pictures: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
}

/// The report: what is printed, and every data point.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    skinned: &'a Skinned,
    data_points: Vec<DataPoint>,
}

#[derive(Serialize)]
struct DataPoint {
    section: usize,
    place_mm: [f64; 3],
    deviation_mm: f64,
    /// Before knots were removed, by the published method.
    #[serde(skip_serializing_if = "Option::is_none")]
    before_mm: Option<f64>,
}

/// Skins; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let skinned = shown::work("skinning", move |shown| skin_file(&args, shown)).await?;
    for warning in &skinned.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &skinned, summary::told)
}

fn skin_file(args: &Args, shown: &Shown) -> Result<Skinned, Failure> {
    let settings = args.settings()?;
    let output = args.output()?;
    let written: Vec<&Path> = std::iter::once(output.as_path())
        .chain(args.report.as_deref())
        .collect();
    places::check_files(&written, &[("file of sections", &args.input)])?;
    args.pictures
        .as_deref()
        .map_or(Ok(()), places::check_directory)?;
    let timestamp = args.timestamp()?;
    let read = read::read(args, shown)?;
    shown.begin("skin");
    let found = regrid::with_threads(args.grid.threads, || {
        skin::skin(&read.sections, &settings, shown)
    })
    .map_err(|error| Failure::at("cannot skin", &error))?;
    let found = found.map_err(|error| match error {
        SkinError::Cancelled(_) => Failure::Interrupted,
        SkinError::Settings(error) => Failure::Usage(error.to_string()),
        other => Failure::at(args.input.display(), &other),
    })?;
    let name = args.name();
    let named = NamedSurface {
        name: &name,
        surface: &found.surface,
        is_closed: [found.is_closed, false],
    };
    write_atomically::<deliverables::DeliverError>(&output, |sink| {
        deliverables::write_surfaces(&[named], &name, timestamp, "", Entities::Rational128, sink)?;
        Ok(())
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let pictures = match &args.pictures {
        Some(directory) => shown::pictures(directory, || {
            skin_pictures(&name, &found, settings.tolerance_mm)
        })?,
        None => Vec::new(),
    };
    let mut warnings = read.notes;
    warnings.extend(found.warnings.iter().map(ToString::to_string));
    let skinned = Skinned {
        output,
        figures: SkinFigures::of(&found, &settings),
        pictures,
        warnings,
    };
    if let Some(path) = &args.report {
        let report = Report {
            skinned: &skinned,
            data_points: data_points(&found),
        };
        write_atomically::<deliverables::DeliverError>(path, |sink| {
            serde_json::to_writer_pretty(&mut *sink, &report)?;
            Ok(sink.write_all(b"\n")?)
        })
        .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    Ok(skinned)
}

fn data_points(found: &Skin) -> Vec<DataPoint> {
    let of = |(k, own): (usize, &skin::Deviation)| DataPoint {
        section: own.section + 1,
        place_mm: own.place_mm,
        deviation_mm: own.off_mm,
        before_mm: found.before_mm.get(k).copied(),
    };
    found.deviations.iter().enumerate().map(of).collect()
}
