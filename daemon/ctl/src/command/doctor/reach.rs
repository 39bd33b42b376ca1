//! Whether the service answers, and what it says about its scanner.

use relief_api::{ScannerLink, ScannerStatus, Status, path};

use super::finding::Finding;
use crate::output::scanner;
use crate::service::{Client, Endpoint, ServiceError};

const CHECK: &str = "service";

/// Asks the service for its status.
pub(super) async fn check(endpoint: Endpoint) -> Finding {
    let asked = Client::new(endpoint.clone()).get(path::STATUS).await;
    let troubles = match &asked {
        Ok(status) => troubles(status),
        Err(_) => Vec::new(),
    };
    match asked {
        Ok(status) if !troubles.is_empty() => Finding::bad(
            CHECK,
            format!(
                "reliefd {} answers at {endpoint}, but {}",
                status.version,
                troubles.join("; ")
            ),
            "see to the scanner's power, cable and port; the service tries again by itself",
        ),
        Ok(status) => Finding::good(
            CHECK,
            format!("reliefd {} answers at {endpoint}", status.version),
        ),
        Err(ServiceError::Unreachable { source, .. }) => Finding::bad(
            CHECK,
            format!("nobody answers at {endpoint} ({source})"),
            match source.kind() {
                std::io::ErrorKind::PermissionDenied => {
                    "add this user to the group of the socket (usermod --append --groups relief \
                     USER) and log in anew"
                }
                _ => {
                    "start it (systemctl start reliefd) and read its log (journalctl -u reliefd); \
                     if it listens elsewhere, say where with --socket or --url"
                }
            },
        ),
        Err(error) => Finding::bad(
            CHECK,
            error.to_string(),
            "see what listens there, and restart the service",
        ),
    }
}

/// What the service says of its scanners that are in trouble.
fn troubles(status: &Status) -> Vec<String> {
    let several: Vec<&ScannerStatus> = match status.scanners.as_slice() {
        [] => vec![&status.scanner],
        scanners => scanners.iter().map(|one| &one.status).collect(),
    };
    let in_trouble = several
        .into_iter()
        .filter(|one| one.link == ScannerLink::Trouble);
    in_trouble
        .map(|one| {
            let why = one.problem.as_deref().unwrap_or("it does not say why");
            format!("its {} is in trouble: {why}", scanner(&one.name))
        })
        .collect()
}
