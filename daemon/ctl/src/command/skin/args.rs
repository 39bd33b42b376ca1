//! What the user may say, and what follows from it.

use std::path::PathBuf;

use clap::ValueEnum;
use jiff::Timestamp;
use scan_files::Units;
use skin::{Method, Settings};

use crate::command::grid::GridArgs;
use crate::command::units::UnitName;
use crate::failure::Failure;

/// Skin stacked cross-sections with a B-spline surface, without a service
///
/// Reads sections from text (a block of `x y z` lines for each, with a blank line or a line
/// `section [NAME] [open|closed]` between two), from the curves of an IGES file (entities 106, 112,
/// 126), or cuts any scan file that `convert` reads into horizontal ones. The surface, which is
/// written to IGES as entity 128, is nowhere farther from a data point than the tolerance, and has
/// as few control points as can be found. `--method jo` is the published way of Jo, Kwon & Han.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The sections, or a scan to be cut into some
    #[arg(value_name = "SECTIONS")]
    pub(super) input: PathBuf,
    /// Where to write the surface; default: the input's name with the ending .igs, in the current
    /// directory
    #[arg(short, long, value_name = "OUT.igs")]
    output: Option<PathBuf>,
    /// How far a data point may be from the surface, millimetres
    #[arg(long, value_name = "MM")]
    tolerance_mm: f64,
    /// How the surface is found: `relief` looks for the fewest control points; `jo` fits each
    /// section by itself, merges their knots and removes those that are not needed
    #[arg(long, value_name = "HOW", value_enum, default_value_t = MethodName::Relief)]
    method: MethodName,
    /// Degree of the surface across sections, 1 to 5
    #[arg(long, value_name = "N", default_value_t = 3)]
    degree: usize,
    /// Refuse sections that run around in different senses, rather than turn them
    #[arg(long)]
    keep_senses: bool,
    /// Cut a scan every so many millimetres; default: at each row of its grid
    #[arg(long, value_name = "MM")]
    pub(super) every_mm: Option<f64>,
    /// Unit of the coordinates in a text or scan file; default: millimetres, or what the file says
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    /// Write a report as JSON, too, with the deviation of every data point
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Draw sections.png and deviations.png into this directory, too: data and surface of each
    /// section, and how far each data point is off
    #[arg(long, value_name = "DIR")]
    pub(super) pictures: Option<PathBuf>,
    /// Name of the surface in CAD programs; default: that of the input
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Time to be written into the file; default: SOURCE_DATE_EPOCH, or when the input was changed
    #[arg(long, value_name = "TIME")]
    timestamp: Option<Timestamp>,
    #[command(flatten)]
    pub(super) grid: GridArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Relief,
    Jo,
}

impl Args {
    pub(super) fn units(&self) -> Option<Units> {
        self.units.map(UnitName::units)
    }

    pub(super) fn settings(&self) -> Result<Settings, Failure> {
        for (flag, length_mm) in [
            ("tolerance", Some(self.tolerance_mm)),
            ("every", self.every_mm),
        ] {
            if let Some(length_mm) = length_mm.filter(|own| !(own.is_finite() && *own > 0.0)) {
                return Err(Failure::Usage(format!(
                    "--{flag}-mm {length_mm}: must be a length above 0"
                )));
            }
        }
        Ok(Settings {
            method: match self.method {
                MethodName::Relief => Method::Relief,
                MethodName::Jo => Method::Jo,
            },
            degree_across: self.degree,
            turn_sections: !self.keep_senses,
            ..Settings::new(self.tolerance_mm)
        })
    }

    /// Name of the surface.
    pub(super) fn name(&self) -> String {
        self.name.clone().unwrap_or_else(|| {
            let stem = self.input.file_stem().unwrap_or(self.input.as_os_str());
            let stem = stem.to_string_lossy();
            stem.split('.').next().unwrap_or("surface").to_owned()
        })
    }

    /// Where the surface goes.
    pub(super) fn output(&self) -> Result<PathBuf, Failure> {
        let output = self
            .output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}.igs", self.name())));
        let ending = output
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("igs" | "iges") => Ok(output),
            _ => Err(Failure::Usage(format!(
                "{}: a skinned surface is written as IGES; name a file with the ending .igs",
                output.display()
            ))),
        }
    }

    /// The time that is written into the file.
    pub(super) fn timestamp(&self) -> Result<Timestamp, Failure> {
        crate::command::timestamp::of(self.timestamp, None, &self.input)
    }
}
