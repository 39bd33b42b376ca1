//! `relief abort`.

use relief_api::{Scan, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// End the running scan: laser off, table stopped; the columns so far are kept
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Abort only if this scan is the running one
    #[arg(value_name = "SCAN")]
    scan: Option<String>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let path = args
        .scan
        .map_or_else(|| path::ABORT.to_owned(), |scan| path::scan_abort(&scan));
    let scan: Scan = client.post(&path, &serde_json::json!({})).await?;
    output::either(json, &scan, |scan| {
        format!(
            "{}: asked to end; {} of {} columns are kept",
            scan.id, scan.columns, scan.columns_planned
        )
    })
}
