//! What the user may say, and what follows from it.

use std::path::PathBuf;

use clap::ValueEnum;
use jiff::Timestamp;
use toolpath::{Cutter, Pattern, Settings};

use crate::failure::Failure;

/// Mill a model: NC code for a machine, without a service
///
/// Reads a STEP file, an IGES file as `convert`, `surface` or `skin` write it, or an STL file in
/// millimetres, z towards the spindle, and leads the cutter over its faces by exact contact, so that
/// the cusps between passes are as high as asked for. Roughing before, if a cutter for it is named.
/// Travel, stock, fixtures, tools, feeds and the control's dialect come from the machine's file, in
/// the model's coordinates but for travel and work offset. The result is checked by a simulated removal
/// of the stock: what moves into material with rapid, or cuts more than 0.01 mm too deep, is not
/// written.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The model: a STEP, IGES or STL file
    #[arg(value_name = "MODEL.step|MODEL.igs|MODEL.stl")]
    pub(super) model: PathBuf,
    /// The machine, what is clamped on it, and its tools; config/machine.toml shows every key
    #[arg(long, value_name = "M.toml")]
    pub(super) machine: PathBuf,
    /// The finishing cutter: ball:DIAMETER, bull:DIAMETER:CORNER or flat:DIAMETER, millimetres
    #[arg(long, value_name = "CUTTER")]
    tool: Cutter,
    /// Rough with this cutter first
    #[arg(long, value_name = "CUTTER")]
    rough: Option<Cutter>,
    /// Where the NC code goes; default: beside the model, with its name
    #[arg(short, long, value_name = "OUT.nc")]
    output: Option<PathBuf>,
    /// Height of the cusps between finishing passes, millimetres
    #[arg(long, value_name = "MM", default_value_t = 0.01)]
    scallop_mm: f64,
    /// How far above contact the cutter may be led to make moves longer, millimetres
    #[arg(long, value_name = "MM", default_value_t = 0.005)]
    tolerance_mm: f64,
    /// Finishing passes: straight ones, or such that all cusps are of one height (ball cutters)
    #[arg(long, value_name = "PATTERN", value_enum, default_value_t = PatternName::Parallel)]
    pattern: PatternName,
    /// Direction of finishing passes, degrees from x towards y
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    angle_deg: f64,
    /// What roughing leaves on the surface, millimetres
    #[arg(long, value_name = "MM", default_value_t = 0.3)]
    allowance_mm: f64,
    /// Straight moves only, no arcs (G2, G3)
    #[arg(long)]
    no_arcs: bool,
    /// Draw how far the machined surface lies off the model, too
    #[arg(long, value_name = "OUT.png")]
    pub(super) picture: Option<PathBuf>,
    /// Distance of the simulation's nodes, millimetres; default: after the model's size
    #[arg(long, value_name = "MM")]
    pub(super) pitch_mm: Option<f64>,
    /// Time in the program's head; default: SOURCE_DATE_EPOCH if set, else when the model's file was
    /// last changed
    #[arg(long, value_name = "TIME")]
    timestamp: Option<Timestamp>,
    /// Threads to use; 0 for all processors. The result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) threads: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PatternName {
    Parallel,
    Scallop,
}

impl Args {
    pub(super) fn output(&self) -> PathBuf {
        let beside = || self.model.with_extension("nc");
        self.output.clone().unwrap_or_else(beside)
    }

    pub(super) fn settings(&self) -> Result<Settings, Failure> {
        let settings = Settings {
            finish: self.tool,
            rough: self.rough,
            scallop_mm: self.scallop_mm,
            tolerance_mm: self.tolerance_mm,
            pattern: match self.pattern {
                PatternName::Parallel => Pattern::Parallel,
                PatternName::Scallop => Pattern::Scallop,
            },
            angle_deg: self.angle_deg,
            allowance_mm: self.allowance_mm,
            arcs: !self.no_arcs,
        };
        settings
            .validate()
            .map_err(|error| Failure::Usage(error.to_string()))?;
        if let Some(pitch_mm) = self.pitch_mm
            && !(1e-3..=10.0).contains(&pitch_mm)
        {
            return Err(Failure::Usage(format!(
                "--pitch-mm {pitch_mm}: must be 0.001 to 10"
            )));
        }
        Ok(settings)
    }

    /// The time that stands in the program's head.
    pub(super) fn timestamp(&self) -> Result<Timestamp, Failure> {
        if let Some(given) = self.timestamp {
            return Ok(given);
        }
        if let Some(epoch) = std::env::var_os("SOURCE_DATE_EPOCH") {
            let seconds = epoch.to_str().and_then(|text| text.parse().ok());
            let time = seconds.and_then(|seconds| Timestamp::from_second(seconds).ok());
            return time.ok_or_else(|| {
                Failure::Usage(format!(
                    "SOURCE_DATE_EPOCH is {epoch:?}, which is not a number of seconds since 1970"
                ))
            });
        }
        let changed = std::fs::metadata(&self.model).and_then(|file| file.modified());
        let changed = changed.ok().and_then(|time| Timestamp::try_from(time).ok());
        Ok(changed.unwrap_or(Timestamp::UNIX_EPOCH))
    }
}
