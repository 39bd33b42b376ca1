//! `relief resume`.

use relief_api::{Scan, path};

use crate::failure::Failure;
use crate::output;
use crate::service::{Client, EndpointArgs};

/// Let the paused scan go on: you have looked, and nothing stands in the way of table and laser
///
/// The table is homed, and the last columns are measured again; only if they are as they were
/// does the scan go on. `relief status` says why a scan pauses.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Only if this scan is the paused one
    #[arg(value_name = "SCAN")]
    scan: Option<String>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = Client::new(args.endpoint.endpoint()?);
    let path = args
        .scan
        .map_or_else(|| path::RESUME.to_owned(), |scan| path::scan_resume(&scan));
    let scan: Scan = client.post(&path, &serde_json::json!({})).await?;
    output::either(json, &scan, |scan| {
        format!(
            "{}: asked to go on after {} of {} columns; `relief watch` tells whether it does",
            scan.id, scan.columns, scan.columns_planned
        )
    })
}
