//! What the user may say.

use std::path::PathBuf;

use jiff::Timestamp;

use crate::service::EndpointArgs;

/// Find out how a mounted scanner deviates from what it announces
///
/// Takes scans of a reference sphere at several places (or of several spheres in one scan), of a
/// step gauge, or of both, and tells the scales of angle, range and table and the table's direction
/// of travel, each with its standard uncertainty, and what the scans do not tell. Place the sphere
/// at five or more places: in the middle and towards the corners of the measuring volume, near and
/// far, and scan it closely. Where the camera stands can be told from spheres at known places alone
/// (--places); no size depends on it. The scans are used as the scanner sent them: a correction that
/// they were taken with is set aside, and the new one replaces it.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Journals (.scan), or scans of the service by id, name or `latest`
    #[arg(value_name = "SCAN", required = true)]
    pub(super) scans: Vec<String>,
    /// Diameter of the reference sphere, millimetres
    #[arg(long, value_name = "MM", required_unless_present = "step_gauge")]
    pub(super) sphere_diameter_mm: Option<f64>,
    /// Known heights of a step gauge's faces: a file with `heights_mm = [0, 10, ...]`, ascending
    /// towards the camera
    #[arg(long, value_name = "FILE.toml")]
    pub(super) step_gauge: Option<PathBuf>,
    /// Known places of the sphere's centre in the part frame: a file with `places_mm = [[x, y, z],
    /// ...]` and `uncertainty_mm`
    #[arg(long, value_name = "FILE.toml", requires = "sphere_diameter_mm")]
    pub(super) places: Option<PathBuf>,
    /// Name of the scanner in the service; scans of another are refused
    #[arg(long, value_name = "NAME")]
    pub(super) scanner: Option<String>,
    /// Write the calibration file that the scanner's section of the configuration names
    #[arg(short, long, value_name = "FILE.toml")]
    pub(super) output: Option<PathBuf>,
    /// Date of the calibration; default: when the last of the scans was taken
    #[arg(long, value_name = "TIME")]
    pub(super) date: Option<Timestamp>,
    #[command(flatten)]
    pub(super) endpoint: EndpointArgs,
}
