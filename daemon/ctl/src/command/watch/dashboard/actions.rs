//! What the user may ask of the service.

use relief_api::{Scan, path};

use crate::failure::with_causes;
use crate::service::Client;

/// Something that is asked of the service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Action {
    /// Stop this scan between two columns.
    Pause(String),
    /// Let this scan go on.
    Resume(String),
    /// End this scan.
    Abort(String),
}

/// Asks, and tells what came of it.
pub(super) async fn act(client: &Client, action: &Action) -> Result<String, String> {
    let (path, asked) = match action {
        Action::Pause(scan) => (path::scan_pause(scan), "to pause"),
        Action::Resume(scan) => (path::scan_resume(scan), "to go on"),
        Action::Abort(scan) => (path::scan_abort(scan), "to end"),
    };
    let scan: Scan = client
        .post(&path, &serde_json::json!({}))
        .await
        .map_err(|error| with_causes(&error))?;
    Ok(format!(
        "{}: asked {asked} after {} of {} columns",
        scan.id, scan.columns, scan.columns_planned
    ))
}
