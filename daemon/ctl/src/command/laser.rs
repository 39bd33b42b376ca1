//! `relief laser`.

use relief_api::{LaserLog, path};

use crate::failure::Failure;
use crate::output::{self, of_scanners};
use crate::service::EndpointArgs;

/// Show when the laser was on and off, and why
///
/// The service keeps all of it in its state folder (laser.jsonl; laser-NAME.jsonl of a scanner
/// with a name), and shows the latest 1000 changes.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Show the laser of this scanner only
    #[arg(long, value_name = "NAME")]
    scanner: Option<String>,
    /// Show so many of the latest changes
    #[arg(long, value_name = "N", default_value_t = 20)]
    last: usize,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let path = match &args.scanner {
        Some(scanner) => path::scanner_laser(scanner),
        None => path::LASER.to_owned(),
    };
    let mut log: LaserLog = client.get(&path).await?;
    log.entries
        .drain(..log.entries.len().saturating_sub(args.last));
    output::either(json, &log, told)
}

fn told(log: &LaserLog) -> String {
    if log.entries.is_empty() {
        return "the scanner has not been asked yet".into();
    }
    let lines = log.entries.iter().map(|entry| {
        (
            entry.scanner.as_str(),
            vec![
                entry.at.clone(),
                entry.laser.as_str().to_owned(),
                entry.scan.clone().unwrap_or_default(),
                entry.cause.clone(),
            ],
        )
    });
    of_scanners(&["SINCE", "LASER", "SCAN", "CAUSE"], 2, &[], lines)
}
