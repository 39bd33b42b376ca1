//! The surface itself.

use std::fmt::Write as _;
use std::path::PathBuf;

use deliverables::{ManifestFile, write_atomically};
use serde::Serialize;
use surfacing::{HeightGrid, Made, Placement, Settings, SurfaceError};

use super::write::{NamedSurface, SurfacesError, surfaces};
use super::{Args, pictures, summary};
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
    pub(super) surface: Figures,
    /// Lines along the grid on which z or the slope jumps.
    pub(super) character_lines: Vec<Line>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fairing: Option<Fairing>,
    /// Every placement beside the others, where that was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) placements: Vec<Figures>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) pictures: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
}

/// What a placement of knots comes to.
#[derive(Serialize)]
pub(super) struct Figures {
    pub(super) knots: &'static str,
    /// Along x and y, for each piece.
    pub(super) pieces: Vec<[usize; 2]>,
    pub(super) control_points: usize,
    pub(super) max_mm: f64,
    pub(super) rms_mm: f64,
    pub(super) nodes: usize,
    pub(super) within_tolerance_share: f64,
}

/// A character line.
#[derive(Serialize)]
pub(super) struct Line {
    pub(super) kind: &'static str,
    /// The coordinate that is constant on it, `x` or `y`.
    pub(super) at: &'static str,
    pub(super) at_mm: f64,
    /// Millimetres of a step, change of slope of a crease.
    pub(super) jump: f64,
}

/// What fairing did.
#[derive(Serialize)]
pub(super) struct Fairing {
    pub(super) bound_mm: f64,
    /// Mean squares of the third derivative along x and y, mm^-4.
    pub(super) variation_before: f64,
    pub(super) variation_after: f64,
    pub(super) greatest_move_mm: f64,
    pub(super) rms_move_mm: f64,
    pub(super) nodes_at_bound: usize,
}

impl Figures {
    fn of(made: &Made) -> Self {
        let report = &made.report;
        Self {
            knots: report.placement.as_str(),
            pieces: report.of_pieces.clone(),
            control_points: report.control_points,
            max_mm: report.max_mm,
            rms_mm: report.rms_mm,
            nodes: report.nodes,
            within_tolerance_share: report.within_tolerance as f64 / report.nodes.max(1) as f64,
        }
    }
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
    let (output, is_step) = args.output()?;
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
                placements.push(Figures::of(&made));
                continue;
            }
            shown.begin(placement.as_str());
            match make(&Settings {
                placement,
                ..settings
            }) {
                Ok(made) => placements.push(Figures::of(&made)),
                Err(Failure::Interrupted) => return Err(Failure::Interrupted),
                // The surface that was asked for is there; only this row is not.
                Err(why) => refusals.push(format!("{}: {why}", placement.as_str())),
            }
        }
    }
    shown.begin("write");
    let parts: Vec<_> = made.pieces.iter().flat_map(|piece| piece.parts()).collect();
    let named: Vec<NamedSurface<'_>> = parts
        .iter()
        .enumerate()
        .map(|(index, surface)| NamedSurface {
            name: match parts.len() {
                1 => name.clone(),
                _ => format!("{name} {}", index + 1),
            },
            surface,
        })
        .collect();
    let author = author.unwrap_or_default();
    let written = write_atomically::<SurfacesError>(&output, |sink| {
        surfaces(&named, &name, timestamp, &author, is_step, sink)
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let pictures = match &args.pictures {
        Some(directory) => pictures::draw(directory, &args.scan_name(), &grid, &made, &settings)?,
        None => Vec::new(),
    };
    let mut warnings: Vec<String> = input
        .notes
        .iter()
        .map(|note| format!("{}: {note}", args.scan.display()))
        .collect();
    warnings.extend(remarks(&made, &settings));
    warnings.extend(refusals);
    Ok(Surfaced {
        output,
        file: written,
        pitch_mm: grid.pitch_mm(),
        as_measured: is_measured,
        tolerance_mm: settings.tolerance_mm,
        noise_mm: made.report.noise_mm,
        surface: Figures::of(&made),
        character_lines: lines(&made),
        fairing: made.report.fairing.map(|fairing| Fairing {
            bound_mm: fairing.bound_mm,
            variation_before: fairing.variation_before,
            variation_after: fairing.variation_after,
            greatest_move_mm: fairing.greatest_move_mm,
            rms_move_mm: fairing.rms_move_mm,
            nodes_at_bound: fairing.at_bound,
        }),
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

fn lines(made: &Made) -> Vec<Line> {
    let pitch_mm = made.data.pitch_mm();
    let line = |line: &surfacing::CharacterLine| Line {
        kind: match line.kind {
            surfacing::LineKind::Step => "step",
            surfacing::LineKind::Crease => "crease",
        },
        at: if line.is_at_x { "x" } else { "y" },
        at_mm: line.at * pitch_mm
            + if line.is_at_x {
                made.data.x_mm(0)
            } else {
                made.data.y_mm(0)
            },
        jump: line.jump,
    };
    made.report.lines.iter().map(line).collect()
}

/// What the user ought to know about the surface.
fn remarks(made: &Made, settings: &Settings) -> Vec<String> {
    let report = &made.report;
    let mut remarks = Vec::new();
    if report.max_mm > settings.tolerance_mm {
        remarks.push(format!(
            "{} knots leave {} of {} grid points outside of the tolerance, the farthest by {:.3} \
             mm; --knots optimal keeps to it",
            report.placement.as_str(),
            report.nodes - report.within_tolerance,
            report.nodes,
            report.max_mm - settings.tolerance_mm
        ));
    }
    // A surface that needs a control point for every fourth data point follows something else
    // than shape.
    if report.placement == Placement::Optimal && 4 * report.control_points > report.nodes {
        let mut remark = format!(
            "the tolerance asks for {} control points for {} grid points",
            report.control_points, report.nodes
        );
        if report.noise_mm > 0.2 * settings.tolerance_mm {
            let _ = write!(
                remark,
                "; the grid's noise is {:.3} mm, five times of which are a sensible \
                 --tolerance-mm, or fair it with --fair-mm",
                report.noise_mm
            );
        } else {
            remark.push_str("; steps in the scan may ask for them, which --roi-x-mm, --roi-y-mm and --roi-z-mm can leave out");
        }
        remarks.push(remark);
    }
    remarks
}
