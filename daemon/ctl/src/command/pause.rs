//! `relief pause`.

use relief_api::{Scan, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Pause the running scan: it stops between two columns, with the laser off, and keeps what it has
///
/// It waits for `relief resume`, also through a restart of the service: then the table is homed,
/// the last columns are measured again, and the scan goes on. Where several scanners scan, say which
/// one is to stop.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Only if this scan is the running one
    #[arg(value_name = "SCAN", conflicts_with = "scanner")]
    scan: Option<String>,
    /// Only the running scan of this scanner
    #[arg(long, value_name = "NAME")]
    scanner: Option<String>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let path = match (&args.scan, &args.scanner) {
        (Some(scan), _) => path::scan_pause(scan),
        (None, Some(scanner)) => path::scanner_pause(scanner),
        (None, None) => path::PAUSE.to_owned(),
    };
    let scan: Scan = client.post(&path, &serde_json::json!({})).await?;
    output::either(json, &scan, |scan| {
        format!(
            "{}: paused, {} of {} columns are kept; `relief resume` lets it go on",
            scan.id, scan.columns, scan.columns_planned
        )
    })
}
