//! Whether the service answers, and what it says about its scanner.

use relief_api::{ScannerLink, Status, path};

use super::finding::Finding;
use crate::service::{Client, Endpoint, ServiceError};

const CHECK: &str = "service";

/// Asks the service for its status.
pub(super) async fn check(endpoint: Endpoint) -> Finding {
    match Client::new(endpoint.clone())
        .get::<Status>(path::STATUS)
        .await
    {
        Ok(status) if status.scanner.link == ScannerLink::Trouble => Finding::bad(
            CHECK,
            format!(
                "reliefd {} answers at {endpoint}, but its scanner is in trouble: {}",
                status.version,
                status
                    .scanner
                    .problem
                    .as_deref()
                    .unwrap_or("it does not say why")
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
