//! What the user may say, and what follows from it.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use deliverables::{Entities, SurfaceFormat};
use jiff::Timestamp;
use scan_files::Units;
use surfacing::{JumpThresholds, Placement, Settings, SurfaceError};

use crate::command::convert::{input_stem, same_file};
use crate::command::grid::GridArgs;
use crate::command::units::UnitName;
use crate::failure::Failure;

/// Make one B-spline surface of a scan, without a service
///
/// Reads a scan file as `convert` does and fits an open cubic B-spline surface to its grid by
/// least squares. Knots are placed as few as the tolerance allows (optimal), in equal spans
/// (uniform), at the vertices of the reference sections' polylines (polyline), or where derivatives
/// of these sections break (derivative); the latter two do not promise the tolerance, and it is said
/// when they exceed it. Where z jumps along a line of the grid, the surface comes in pieces; where
/// the slope does, pieces meet on that line; so it is with optimal knots. Where such lines run across
/// the grid, oblique or curved, and pieces that end on them take fewer control points, these are
/// trimmed surfaces. Samples that lie on a uniform
/// grid already are taken as they are, unless --pitch-mm or a --roi is given.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan file
    #[arg(value_name = "SCAN")]
    pub(super) scan: PathBuf,
    /// The file to write; its ending picks the format: IGES (.igs or .iges), or STEP (.step or
    /// .stp). Default: the scan's name with .igs, in the current directory
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// IGES entities of the surfaces: 128 (rational B-splines), or 114 (parametric splines of the
    /// same shape); default: 128
    #[arg(long, value_name = "TYPE", value_enum)]
    entities: Option<EntityName>,
    /// Greatest distance in z between surface and grid, millimetres
    #[arg(long, value_name = "MM")]
    pub(super) tolerance_mm: f64,
    /// How knots are placed
    #[arg(long, value_name = "HOW", value_enum, default_value_t = KnotsName::Optimal)]
    knots: KnotsName,
    /// Jumps of z and its first three derivatives that are breaks, millimetres, the parameter
    /// counting grid points; for derivative knots. Raised where noise asks for more
    #[arg(long, value_name = "C0,C1,C2,C3", value_delimiter = ',', default_values_t = JumpThresholds::default().0)]
    thresholds: Vec<f64>,
    /// Move grid points by up to this before, millimetres, so that curvature varies less; feature
    /// lines stay sharp
    #[arg(long, value_name = "MM")]
    pub(super) fair_mm: Option<f64>,
    /// Trim nothing: knots follow lines across the grid, too, however many that takes
    #[arg(long)]
    untrimmed: bool,
    /// Also tell what each placement of knots comes to
    #[arg(long)]
    pub(super) compare: bool,
    /// Draw deviations.png, and contours and curvature before and after fairing, into this
    /// directory, too
    #[arg(long, value_name = "DIR")]
    pub(super) pictures: Option<PathBuf>,
    /// Unit of the coordinates in the file; default: millimetres, or what the file says
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    #[command(flatten)]
    pub(super) grid: GridArgs,
    /// Name of the surface in the file; default: that kept with the scan, or the scan's name
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Time in the file, such as 2026-11-21T09:30:00Z. Default: SOURCE_DATE_EPOCH (seconds since
    /// 1970), else when the scan was taken, else when the scan file was last changed
    #[arg(long, value_name = "TIME")]
    pub(super) timestamp: Option<Timestamp>,
    /// Author in the file
    #[arg(long, value_name = "NAME")]
    pub(super) author: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EntityName {
    #[value(name = "114")]
    Parametric,
    #[value(name = "128")]
    Rational,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum KnotsName {
    Uniform,
    Polyline,
    Derivative,
    Optimal,
}

impl Args {
    /// Where the surface goes, and as what.
    pub(super) fn output(&self) -> Result<(PathBuf, SurfaceFormat), Failure> {
        let path = match &self.output {
            Some(path) => path.clone(),
            None => PathBuf::from(format!("{}.igs", input_stem(&self.scan))),
        };
        let ending = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        let format = match ending.as_deref() {
            Some("igs" | "iges") => SurfaceFormat::Iges(match self.entities {
                Some(EntityName::Parametric) => Entities::Parametric114,
                Some(EntityName::Rational) | None => Entities::Rational128,
            }),
            Some("step" | "stp") if self.entities.is_some() => {
                return Err(Failure::Usage(format!(
                    "--entities is about IGES files, and {} is none",
                    path.display()
                )));
            }
            Some("step" | "stp") => SurfaceFormat::Step,
            _ => {
                return Err(Failure::Usage(format!(
                    "the ending of {} names no format that a surface is written in; known: .igs, \
                     .iges, .step, .stp",
                    path.display()
                )));
            }
        };
        if same_file(&path, &self.scan) {
            return Err(Failure::Usage(format!(
                "{} is the scan file itself; name another output with -o",
                path.display()
            )));
        }
        Ok((path, format))
    }

    /// Name of the surface.
    pub(super) fn name(&self, kept: Option<&str>) -> String {
        let given = self
            .name
            .as_deref()
            .or(kept)
            .filter(|name| !name.trim().is_empty());
        given.map_or_else(|| input_stem(&self.scan), str::to_owned)
    }

    pub(super) fn units(&self) -> Option<Units> {
        self.units.map(UnitName::units)
    }

    /// How the surface is made.
    pub(super) fn settings(&self) -> Result<Settings, Failure> {
        let thresholds = <[f64; 4]>::try_from(self.thresholds.as_slice()).map_err(|_| {
            Failure::Usage(format!(
                "--thresholds takes 4 numbers, for the derivatives 0 to 3, but {} were given",
                self.thresholds.len()
            ))
        })?;
        let settings = Settings {
            tolerance_mm: self.tolerance_mm,
            placement: match self.knots {
                KnotsName::Uniform => Placement::Uniform,
                KnotsName::Polyline => Placement::Polyline,
                KnotsName::Derivative => Placement::Derivative,
                KnotsName::Optimal => Placement::Optimal,
            },
            thresholds: JumpThresholds(thresholds),
            fair_mm: self.fair_mm,
            may_trim: !self.untrimmed,
        };
        settings.validate().map_err(|error| {
            let option = match &error {
                SurfaceError::Setting { what, .. } if what.contains("fairing") => "--fair-mm",
                SurfaceError::Threshold { .. } => "--thresholds",
                _ => "--tolerance-mm",
            };
            Failure::Usage(format!("{option}: {error}"))
        })?;
        Ok(settings)
    }

    /// The scan's file, for titles.
    pub(super) fn scan_name(&self) -> String {
        let name = self.scan.file_name().unwrap_or(Path::as_os_str(&self.scan));
        name.to_string_lossy().into_owned()
    }
}
