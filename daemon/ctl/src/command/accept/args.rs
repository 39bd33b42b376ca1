//! What the user may say.

use std::path::PathBuf;

use crate::service::EndpointArgs;

/// Hold a scanner against references with known sizes
///
/// Takes scans of spheres, of two spheres at a known distance, of a step gauge or of a flat plate,
/// and holds the scanner's errors against the maximum permissible ones of the reference's file, in
/// the manner of VDI/VDE 2634; it is no certificate. Scans of the same tell how the figures repeat,
/// five or more how they drift. Exit code 0 when every figure with a limit is within it, 1 when one
/// is not, or when it did not succeed.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Journals (.scan), or scans of the service by id, name or `latest`
    #[arg(value_name = "SCAN", required = true)]
    pub(super) scans: Vec<String>,
    /// What the scans show, and the limits
    #[arg(long, value_name = "FILE.toml")]
    pub(super) reference: PathBuf,
    /// Judge the scans as if they had been taken with this calibration, instead of the one they
    /// were taken with
    #[arg(long, value_name = "FILE.toml")]
    pub(super) calibration: Option<PathBuf>,
    /// Write a report as JSON, too
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Write a page to be filed, too; its ending picks the form, HTML (.html) or PDF (.pdf). May
    /// be given for each
    #[arg(long, value_name = "OUT.html|OUT.pdf")]
    pub(super) page: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) endpoint: EndpointArgs,
}
