//! `relief resume`.

use relief_api::{Scan, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Let the paused scan go on: you have looked, and nothing stands in the way of table and laser
///
/// The table is homed, and the last columns are measured again; only if they are as they were
/// does the scan go on. `relief status` says why a scan pauses. Where scans of several scanners
/// are paused, say which one you have looked at.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Only if this scan is the paused one
    #[arg(value_name = "SCAN", conflicts_with = "scanner")]
    scan: Option<String>,
    /// Only the paused scan of this scanner
    #[arg(long, value_name = "NAME")]
    scanner: Option<String>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let path = match (&args.scan, &args.scanner) {
        (Some(scan), _) => path::scan_resume(scan),
        (None, Some(scanner)) => path::scanner_resume(scanner),
        (None, None) => path::RESUME.to_owned(),
    };
    let scan: Scan = client.post(&path, &serde_json::json!({})).await?;
    output::either(json, &scan, |scan| {
        format!(
            "{}: asked to go on after {} of {} columns; `relief watch` tells whether it does",
            scan.id, scan.columns, scan.columns_planned
        )
    })
}
