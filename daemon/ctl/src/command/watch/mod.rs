//! `relief watch`.

mod dashboard;
mod plain;

use std::io::IsTerminal;

use crate::failure::Failure;
use crate::service::EndpointArgs;

/// Show what the service does, as it happens, until q or Ctrl-C
///
/// On a terminal it fills the screen: scanners and their lasers, the scan under way with its
/// range image, jobs, results and the latest events. Keys: p pauses the scan, r lets it go on, a
/// aborts it, Tab goes to the next scanner, ? tells more, q ends the looking, not the scan.
/// Elsewhere, and with --plain, --count or --json, events are told line by line.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// End after this many events
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Tell events line by line on a terminal, too
    #[arg(long)]
    plain: bool,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let is_for_people = !json && !args.plain && args.count.is_none();
    if is_for_people && std::io::stdout().is_terminal() && std::io::stdin().is_terminal() {
        return dashboard::run(client).await;
    }
    plain::run(&client, args.count, json).await
}
