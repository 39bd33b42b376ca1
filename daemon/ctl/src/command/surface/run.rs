//! The surface itself.

use std::path::PathBuf;

use deliverables::{
    CharacterLineFigures, FairingFigures, ManifestFile, SurfaceFigures, SurfaceWords,
    SurfacesError, TrimmedFigures, surface_pictures, surface_remarks, write_atomically, write_made,
};
use serde::Serialize;
use surfacing::{HeightGrid, Placement, Settings, SurfaceError};

use super::{Args, summary};
use crate::command::shown::{self, Shown};
use crate::command::{grid, places, timestamp};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Surfaced {
    pub(super) output: PathBuf,
    pub(super) file: ManifestFile,
    pub(super) pitch_mm: f64,
    /// Whether the samples lie on a uniform grid already, and were taken as they are.
    pub(super) as_measured: bool,
    pub(super) tolerance_mm: f64,
    /// Noise of the grid, one standard deviation.
    pub(super) noise_mm: f64,
    pub(super) surface: SurfaceFigures,
    /// Lines along the grid on which z or the slope jumps.
    pub(super) character_lines: Vec<CharacterLineFigures>,
    /// How pieces meet that lines across the grid bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) trimmed: Option<TrimmedFigures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fairing: Option<FairingFigures>,
    /// Every placement beside the others, where that was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) placements: Vec<SurfaceFigures>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) pictures: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
}

/// Makes the surface; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let made = shown::work("the surface", move |shown| surface_of_file(&args, shown)).await?;
    for warning in &made.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &made, summary::told)
}

fn surface_of_file(args: &Args, shown: &Shown) -> Result<Surfaced, Failure> {
    let (output, format) = args.output()?;
    let settings = args.settings()?;
    places::check_file(&output)?;
    args.pictures
        .as_deref()
        .map_or(Ok(()), places::check_directory)?;
    let input = grid::scan(&args.scan, args.units())?;
    let regrid = args.grid.apply(input.settings().regrid)?;
    let timestamp = timestamp::of(args.timestamp, input.timestamp, &args.scan)?;
    let name = args.name(input.name.as_deref());
    let author = args.author.clone().or(input.scan.operator.clone());
    let measured = match args.grid.asks_for_a_grid() {
        true => None,
        false => HeightGrid::from_columns(&input.columns),
    };
    let is_measured = measured.is_some();
    let grid = match measured {
        Some(grid) => grid,
        None => {
            let image = grid::image(&input, &regrid, &args.scan, shown)?;
            HeightGrid::from_image(&image).map_err(|error| refused(args, error))?
        }
    };
    let refused = |error| refused(args, error);
    let make = |settings: &Settings| {
        let made = regrid::with_threads(regrid.threads, || surfacing::make(&grid, settings, shown));
        made.map_err(|error| Failure::at("cannot make the surface", &error))?
            .map_err(refused)
    };
    shown.begin("surface");
    let made = make(&settings)?;
    let (mut placements, mut refusals) = (Vec::new(), Vec::new());
    if args.compare {
        for placement in Placement::ALL {
            if placement == settings.placement {
                placements.push(SurfaceFigures::of(&made));
                continue;
            }
            shown.begin(placement.as_str());
            match make(&Settings {
                placement,
                ..settings
            }) {
                Ok(made) => placements.push(SurfaceFigures::of(&made)),
                Err(Failure::Interrupted) => return Err(Failure::Interrupted),
                // The surface that was asked for is there; only this row is not.
                Err(why) => refusals.push(format!("{}: {why}", placement.as_str())),
            }
        }
    }
    shown.begin("write");
    let author = author.unwrap_or_default();
    let written = write_atomically::<SurfacesError>(&output, |sink| {
        write_made(&made, &name, timestamp, &author, format, sink)
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let pictures = match &args.pictures {
        Some(directory) => shown::pictures(directory, || {
            surface_pictures(&args.scan_name(), &grid, &made, &settings)
        })?,
        None => Vec::new(),
    };
    let mut warnings: Vec<String> = input
        .notes
        .iter()
        .map(|note| format!("{}: {note}", args.scan.display()))
        .collect();
    warnings.extend(surface_remarks(&made, &settings, SurfaceWords::OPTIONS));
    warnings.extend(refusals);
    Ok(Surfaced {
        output,
        file: written,
        pitch_mm: grid.pitch_mm(),
        as_measured: is_measured,
        tolerance_mm: settings.tolerance_mm,
        noise_mm: made.report.noise_mm,
        surface: SurfaceFigures::of(&made),
        character_lines: CharacterLineFigures::of(&made),
        trimmed: TrimmedFigures::of(&made),
        fairing: FairingFigures::of(&made),
        placements,
        pictures,
        warnings,
    })
}

fn refused(args: &Args, error: SurfaceError) -> Failure {
    match error {
        SurfaceError::Cancelled(_) => Failure::Interrupted,
        error => Failure::Failed(format!("{}: {error}", args.scan.display())),
    }
}
