//! `relief demo`: the whole road on one machine, with a simulated scanner.

mod bench;
mod run;

use std::path::PathBuf;

pub(crate) use run::run;

use super::regularize::RegularizeArgs;

/// Scan a simulated part and turn it into a CAD file, to see how it all works
///
/// A private service and a simulated scanner on a pseudo-terminal do what a real scanner
/// and the installed service would do: the part is scanned column by column, regridded as
/// the table moves, segmented, fitted, trimmed and exported. Nothing but the output
/// directory is left behind.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// What stands on the table: house, cylinder; house-on-table or cylinder-on-table, with
    /// table and wall in view; house-before-plane; or an STL file in millimetres, which
    /// keeps its coordinates
    #[arg(long, value_name = "NAME|FILE.stl", default_value = "house")]
    object: String,
    /// Where the deliverables go
    #[arg(long, value_name = "DIR", default_value = "relief-demo")]
    out: PathBuf,
    /// Seed of the scanner's noise and of the processing's random draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the range noise, millimetres [default: 0.05]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    noise_mm: Option<f64>,
    /// Share of samples that lie anywhere in range [default: 0]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    outliers: Option<f64>,
    /// Share of samples at steps that lie between both sides [default: 0.1]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    mixed: Option<f64>,
    /// Share of rays that bring no sample [default: 0.001]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    dropouts: Option<f64>,
    /// Share of rays lost where the object's gloss mirrors them straight at the sensor
    /// [default: 0]
    #[arg(
        long,
        value_name = "SHARE",
        allow_negative_numbers = true,
        requires = "glare_width_deg"
    )]
    glare: Option<f64>,
    /// Angle between mirrored ray and sensor over which that fades (1 sigma), degrees
    #[arg(
        long,
        value_name = "DEG",
        allow_negative_numbers = true,
        requires = "glare"
    )]
    glare_width_deg: Option<f64>,
    #[command(flatten)]
    regularize: RegularizeArgs,
}
