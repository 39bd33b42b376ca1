//! What the user may say, and what follows from it.

use std::path::PathBuf;

use clap::ValueEnum;
use compare::{Alignment, CompareSettings, Tolerance};
use scan_files::Units;

use crate::command::grid::GridArgs;
use crate::command::units::UnitName;
use crate::failure::Failure;

/// Hold a scan against its nominal, without a service
///
/// Reads a scan file as `convert` does, and the nominal from a STEP file, or from an STL file in
/// millimetres. The scan is brought onto the nominal by best fit, from wherever it lies, or compared
/// as placed; its deviations are distances along the nominal's normals, positive where there is
/// more material. What lies significantly beyond the tolerance is told with place, size and depth.
/// Exit code 0 when there is nothing, 1 when there is, or when it did not succeed.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan file
    #[arg(value_name = "SCAN")]
    pub(super) scan: PathBuf,
    /// The nominal: a STEP or STL file of the part, seen from +z as the scan is
    #[arg(value_name = "NOMINAL.step|NOMINAL.stl")]
    pub(super) nominal: PathBuf,
    /// Bring the scan onto the nominal by best fit, or compare both as placed
    #[arg(long, value_name = "HOW", value_enum, default_value_t = AlignName::BestFit)]
    align: AlignName,
    /// Deviations allowed to either side, millimetres; default: none that is significant
    #[arg(long, value_name = "MM", conflicts_with_all = ["upper_mm", "lower_mm"])]
    tolerance_mm: Option<f64>,
    /// Greatest deviation allowed, millimetres
    #[arg(
        long,
        value_name = "MM",
        requires = "lower_mm",
        allow_hyphen_values = true
    )]
    upper_mm: Option<f64>,
    /// Least deviation allowed, millimetres; usually negative
    #[arg(
        long,
        value_name = "MM",
        requires = "upper_mm",
        allow_hyphen_values = true
    )]
    lower_mm: Option<f64>,
    /// Points farther than this from the nominal belong to something else, millimetres;
    /// default: 2, ten times the noise, or three times the tolerance, whatever is most
    #[arg(long, value_name = "MM")]
    limit_mm: Option<f64>,
    /// Diameter of the smallest patch whose mean deviation is told, millimetres; default: 5.5
    /// times the distance of samples
    #[arg(long, value_name = "MM")]
    patch_mm: Option<f64>,
    /// Probability, at most, that anything is told of a part that meets its tolerance
    #[arg(long, value_name = "P", default_value_t = 0.01)]
    false_alarm: f64,
    /// Write a report as JSON, too
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Write a page to be filed, too; its ending picks the form, HTML (.html) or PDF (.pdf). May
    /// be given for each
    #[arg(long, value_name = "OUT.html|OUT.pdf")]
    pub(super) page: Vec<PathBuf>,
    /// Draw a map of the deviations with a histogram, too
    #[arg(long, value_name = "FILE.png")]
    pub(super) map: Option<PathBuf>,
    /// Unit of the coordinates in the scan file; default: millimetres, or what the file says
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    /// Unit of the coordinates in the nominal's file if that is STL, which does not say; default:
    /// millimetres
    #[arg(long, value_name = "UNIT", value_enum)]
    nominal_units: Option<UnitName>,
    #[command(flatten)]
    pub(super) grid: GridArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum AlignName {
    BestFit,
    AsPlaced,
}

impl Args {
    pub(super) fn units(&self) -> Option<Units> {
        self.units.map(UnitName::units)
    }

    /// Millimetres in a unit of the nominal's file, where that is said.
    pub(super) fn nominal_unit_mm(&self) -> Option<f64> {
        self.nominal_units.map(|name| name.units().in_mm())
    }

    /// How the scan is compared.
    pub(super) fn settings(&self) -> Result<CompareSettings, Failure> {
        if let Some(tolerance_mm) = self.tolerance_mm
            && !(tolerance_mm > 0.0 && tolerance_mm <= 1000.0)
        {
            return Err(Failure::Usage(format!(
                "--tolerance-mm {tolerance_mm}: must be above 0 and at most 1000"
            )));
        }
        let sides = self.lower_mm.zip(self.upper_mm);
        let sides = sides.or(self.tolerance_mm.map(|both| (-both, both)));
        let settings = CompareSettings {
            alignment: match self.align {
                AlignName::BestFit => Alignment::BestFit,
                AlignName::AsPlaced => Alignment::AsPlaced,
            },
            tolerance: sides.map(|(lower_mm, upper_mm)| Tolerance { lower_mm, upper_mm }),
            limit_mm: self.limit_mm,
            patch_mm: self.patch_mm,
            false_alarm: self.false_alarm,
            ..CompareSettings::default()
        };
        settings
            .validate()
            .map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(settings)
    }
}
