//! `relief abort`.

use relief_api::{Aborted, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// End scans: laser off, table stopped; the columns so far are kept
///
/// Without SCAN and --scanner, the scans of all scanners end: in doubt, no laser stays on.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// End only this scan
    #[arg(value_name = "SCAN", conflicts_with_all = ["scanner", "all"])]
    scan: Option<String>,
    /// End only the scan of this scanner
    #[arg(long, value_name = "NAME", conflicts_with = "all")]
    scanner: Option<String>,
    /// End the scans of all scanners, as without any choice
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let path = match (&args.scan, &args.scanner) {
        (Some(scan), _) => path::scan_abort(scan),
        (None, Some(scanner)) => path::scanner_abort(scanner),
        (None, None) => path::ABORT.to_owned(),
    };
    let aborted: Aborted = client.post(&path, &serde_json::json!({})).await?;
    output::either(json, &aborted, |aborted| {
        let scans = std::iter::once(&aborted.scan).chain(&aborted.others);
        let lines = scans.map(|scan| {
            format!(
                "{}: asked to end; {} of {} columns are kept",
                scan.id, scan.columns, scan.columns_planned
            )
        });
        lines.collect::<Vec<_>>().join("\n")
    })
}
