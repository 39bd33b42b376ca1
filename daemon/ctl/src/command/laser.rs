//! `relief laser`.

use relief_api::{LaserLog, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Show when the laser was on and off, and why
///
/// The service keeps all of it in laser.jsonl of its state folder, and shows the latest 1000
/// changes.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Show so many of the latest changes
    #[arg(long, value_name = "N", default_value_t = 20)]
    last: usize,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let mut log: LaserLog = client.get(path::LASER).await?;
    log.entries
        .drain(..log.entries.len().saturating_sub(args.last));
    output::either(json, &log, told)
}

fn told(log: &LaserLog) -> String {
    if log.entries.is_empty() {
        return "the scanner has not been asked yet".into();
    }
    let lines = log.entries.iter().map(|entry| {
        vec![
            entry.at.clone(),
            entry.laser.as_str().to_owned(),
            entry.scan.clone().unwrap_or_default(),
            entry.cause.clone(),
        ]
    });
    output::table(&["SINCE", "LASER", "SCAN", "CAUSE"], &[], lines)
}
