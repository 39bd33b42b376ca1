//! Whether the NATS servers are reached by which jobs go elsewhere, and workers are there.

use std::time::Duration;

use hyper::Uri;
use relief_api::{Fleet, path};
use reliefd::config::NatsConfig;
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::finding::Finding;
use crate::output::counted;
use crate::service::{Client, Endpoint};

const CHECK: &str = "NATS servers";

/// Port of a NATS server whose address names none.
const PORT: u16 = 4222;

/// How long a server may take to accept a connection.
const PATIENCE: Duration = Duration::from_secs(3);

/// Asks the service how it stands with its servers; where it does not answer, looks itself whether
/// something listens there. Nothing where none are named.
pub(super) async fn check(endpoint: Endpoint, config: &NatsConfig) -> Option<Finding> {
    match Client::new(endpoint).get::<Fleet>(path::FLEET).await {
        Ok(fleet) if fleet.is_used => Some(of_service(&fleet)),
        Ok(_) if config.is_used() => Some(Finding::doubtful(
            CHECK,
            "the configuration names servers, and the service that runs uses none",
            "restart it (systemctl restart reliefd): a reload does not change [nats]",
        )),
        Err(_) if config.is_used() => Some(from_here(&config.servers).await),
        Ok(_) | Err(_) => None,
    }
}

fn of_service(fleet: &Fleet) -> Finding {
    let servers = fleet.servers.join(", ");
    match &fleet.problem {
        Some(problem) => Finding::bad(
            CHECK,
            format!("{} is not served: {problem}", fleet.bench),
            "see that they run, that this machine reaches them, and what [nats] says of them; the \
             service tries again by itself, and does jobs itself meanwhile if it may",
        ),
        None if fleet.workers.is_empty() => Finding::doubtful(
            CHECK,
            format!(
                "{} is connected with {servers}, and no worker is there",
                fleet.bench
            ),
            "start one (relief worker --connect ...), or give a service the role \"work\"",
        ),
        None => Finding::good(
            CHECK,
            format!(
                "{} is connected with {servers}; {} there",
                fleet.bench,
                counted(fleet.workers.len(), "worker")
            ),
        ),
    }
}

async fn from_here(servers: &[String]) -> Finding {
    let mut silent = Vec::new();
    for server in servers {
        if let Err(why) = listens(server).await {
            silent.push(format!("{server}: {why}"));
        }
    }
    if silent.is_empty() {
        let found = format!("something listens at {}", servers.join(", "));
        Finding::good(CHECK, found)
    } else {
        Finding::bad(
            CHECK,
            format!("nobody listens at {}", silent.join("; ")),
            "see that they run (systemctl status nats-server), that no firewall is between, and \
             that nats.servers is right",
        )
    }
}

async fn listens(server: &str) -> Result<(), String> {
    let uri: Uri = server.parse().map_err(|_| "no address".to_owned())?;
    let host = uri.host().unwrap_or_default().trim_matches(['[', ']']);
    let connecting = TcpStream::connect((host, uri.port_u16().unwrap_or(PORT)));
    match timeout(PATIENCE, connecting).await {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err(format!("no answer in {} s", PATIENCE.as_secs())),
    }
}
