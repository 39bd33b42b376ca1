//! `relief discover`.

use std::time::Duration;

use reliefd::discovery::{Found, MDNS_PORT, look_around};
use serde::Serialize;

use crate::failure::Failure;
use crate::output;

/// List the services that announce themselves on the local network
///
/// A service does so where its configuration has `[discovery] announce = true`. What is listed is
/// what others on the network say: a token is for no service whose certificate does not hold.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// How long to listen, in seconds
    #[arg(long, value_name = "S", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=60))]
    seconds: u64,
    /// UDP port of multicast DNS
    #[arg(long, hide = true, default_value_t = MDNS_PORT)]
    mdns_port: u16,
}

/// What was heard; `--json` prints it.
#[derive(Serialize)]
struct Services {
    services: Vec<Found>,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let longest = Duration::from_secs(args.seconds);
    let looking = tokio::task::spawn_blocking(move || look_around(args.mdns_port, longest));
    let services = looking
        .await
        .map_err(|error| Failure::at("the search broke off", &error))?
        .map_err(|error| Failure::at("cannot look around", &error))?;
    output::either(json, &Services { services }, |found| {
        told(&found.services, args.seconds)
    })
}

fn told(services: &[Found], seconds: u64) -> String {
    if services.is_empty() {
        return format!(
            "no service was heard within {seconds} s; one announces itself where its \
             configuration has [discovery] announce = true"
        );
    }
    let lines = services.iter().map(|service| {
        vec![
            service.name.clone(),
            service.url.clone(),
            service.version.clone(),
            service.scanners.join(" "),
            service.addresses.join(" "),
        ]
    });
    output::table(
        &["SERVICE", "URL", "VERSION", "SCANNERS", "ADDRESSES"],
        &[],
        lines,
    )
}
