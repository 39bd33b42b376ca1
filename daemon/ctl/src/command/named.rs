//! Scans as users name them.

use relief_api::{Scan, ScanList, path};

use crate::failure::Failure;
use crate::service::Client;

/// Means the newest scan.
const LATEST: &str = "latest";

/// The identifier of the scan that a user means by its identifier, its name or `latest`.
/// What no scan is called is given back, for the service to say so: the results of reruns
/// have names of their own.
pub(super) async fn scan_id(client: &Client, said: String) -> Result<String, Failure> {
    let list: ScanList = client.get(path::SCANS).await?;
    match meant(&list.scans, &said) {
        Some(scan) => Ok(scan.id.clone()),
        None if said == LATEST => Err(Failure::Failed("there is no scan yet".into())),
        None => Ok(said),
    }
}

/// Identifiers come first; of several scans of one name the newest is meant.
fn meant<'a>(newest_first: &'a [Scan], said: &str) -> Option<&'a Scan> {
    if said == LATEST {
        return newest_first.first();
    }
    let with_id = newest_first.iter().find(|scan| scan.id == said);
    with_id.or_else(|| newest_first.iter().find(|scan| scan.name == said))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(id: &str, name: &str) -> Scan {
        let state = serde_json::json!({
            "id": id, "name": name, "state": "complete", "started_at": "2026-11-21T09:30:00Z",
        });
        serde_json::from_value(state).unwrap()
    }

    #[test]
    fn a_name_means_its_newest_scan() {
        let scans = [
            scan("3-lid", "lid"),
            scan("2-box", "box"),
            scan("1-box", "box"),
        ];
        let id = |said| meant(&scans, said).map(|scan| scan.id.as_str());
        assert_eq!(id("box"), Some("2-box"));
        assert_eq!(id("1-box"), Some("1-box"));
        assert_eq!(id("latest"), Some("3-lid"));
        assert_eq!(id("bo"), None);
        assert_eq!(meant(&[], "latest"), None);
    }

    #[test]
    fn an_identifier_beats_a_name() {
        let scans = [scan("2-x", "1-x"), scan("1-x", "x")];
        assert_eq!(meant(&scans, "1-x").unwrap().id, "1-x");
    }
}
