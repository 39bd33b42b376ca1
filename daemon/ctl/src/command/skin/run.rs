//! The skinning itself.

use std::path::PathBuf;

use cad_exchange::iges::NamedSurface;
use deliverables::write_atomically;
use serde::Serialize;
use skin::{Method, Skin, SkinError};

use super::{Args, read, summary};
use crate::command::shown::{self, Shown};
use crate::command::{convert, places};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints, and the report holds.
#[derive(Debug, Serialize)]
pub(super) struct Skinned {
    pub(super) output: PathBuf,
    pub(super) method: &'static str,
    pub(super) tolerance_mm: f64,
    /// Whether sections are closed.
    pub(super) closed: bool,
    pub(super) sections: Vec<OfSection>,
    pub(super) counts: Counts,
    pub(super) deviation: Deviation,
    pub(super) warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct OfSection {
    pub(super) name: String,
    /// Parameter across, 0 to 1.
    pub(super) height: f64,
    pub(super) points: usize,
    /// Knots of its own curve, by the published method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) knots: Option<usize>,
    pub(super) rms_mm: f64,
    pub(super) max_mm: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Counts {
    /// Knots around once those of all sections are merged, by the published method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) knots_merged: Option<usize>,
    pub(super) knots_around: usize,
    pub(super) points_around: usize,
    pub(super) points_across: usize,
    pub(super) points: usize,
}

#[derive(Debug, Serialize)]
pub(super) struct Deviation {
    pub(super) rms_mm: f64,
    pub(super) max_mm: f64,
    pub(super) within_tolerance_share: f64,
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
    places::check_file(&output)?;
    for written in std::iter::once(&output).chain(&args.report) {
        if convert::same_file(written, &args.input) {
            return Err(Failure::Usage(format!(
                "{} is read, and cannot be written as well; choose another name with -o",
                written.display()
            )));
        }
    }
    args.report.as_deref().map_or(Ok(()), places::check_file)?;
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
        deliverables::write_surfaces(&[named], &name, timestamp, "", sink)?;
        Ok(())
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let mut warnings = read.notes;
    warnings.extend(found.warnings.iter().map(ToString::to_string));
    let skinned = told(&found, output, &settings, warnings);
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

fn told(
    found: &Skin,
    output: PathBuf,
    settings: &skin::Settings,
    warnings: Vec<String>,
) -> Skinned {
    let section = |(k, name): (usize, &String)| {
        let from = found.deviations.partition_point(|own| own.section < k);
        let own = found.deviations[from..]
            .iter()
            .take_while(|own| own.section == k);
        let (mut points, mut squares, mut max_mm) = (0_usize, 0.0, 0.0_f64);
        for own in own {
            points += 1;
            squares += own.off_mm * own.off_mm;
            max_mm = max_mm.max(own.off_mm);
        }
        OfSection {
            name: name.clone(),
            height: found.heights[k],
            points,
            knots: found.counts.of_sections.get(k).copied(),
            rms_mm: (squares / points.max(1) as f64).sqrt(),
            max_mm,
        }
    };
    let within = found
        .deviations
        .iter()
        .filter(|own| own.off_mm <= settings.tolerance_mm);
    let share = within.count() as f64 / found.deviations.len().max(1) as f64;
    Skinned {
        output,
        method: match settings.method {
            Method::Relief => "relief",
            Method::Jo => "jo",
        },
        tolerance_mm: settings.tolerance_mm,
        closed: found.is_closed,
        sections: found.sections.iter().enumerate().map(section).collect(),
        counts: Counts {
            knots_merged: found.counts.merged,
            knots_around: found.counts.around,
            points_around: found.counts.points_around,
            points_across: found.counts.rows,
            points: found.counts.points(),
        },
        deviation: Deviation {
            rms_mm: found.rms_mm(),
            max_mm: found.most_mm(),
            within_tolerance_share: share,
        },
        warnings,
    }
}
