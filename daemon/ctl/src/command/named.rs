//! Scans as users name them.

use relief_api::{Job, JobList, JobState, Scan, ScanList, path};

use crate::failure::Failure;
use crate::service::Client;

/// Means the newest scan.
const LATEST: &str = "latest";

/// The identifier of the scan that a user means by its identifier, its name or `latest`.
/// What no scan is called is given back, for the service to say so: the results of reruns
/// have names of their own.
pub(crate) async fn scan_id(client: &Client, said: String) -> Result<String, Failure> {
    let list: ScanList = client.get(path::SCANS).await?;
    match meant(&list.scans, &said) {
        Some(scan) => Ok(scan.id.clone()),
        None if said == LATEST => Err(Failure::Failed("there is no scan yet".into())),
        None => Ok(said),
    }
}

/// The result in the spool that a user means: that of a scan, by what names the scan, or
/// that of a rerun, by the result's own name or the one the rerun was given.
pub(super) async fn result(client: &Client, said: String) -> Result<String, Failure> {
    let result = scan_id(client, said).await?;
    let list: JobList = client.get(path::JOBS).await?;
    Ok(rerun(&list.jobs, &result)
        .map(|job| job.result.clone())
        .unwrap_or(result))
}

/// The newest finished rerun of this name, unless the name is that of a result.
fn rerun<'a>(newest_first: &'a [Job], said: &str) -> Option<&'a Job> {
    if newest_first.iter().any(|job| job.result == said) {
        return None;
    }
    newest_first
        .iter()
        .find(|job| job.name == said && job.state == JobState::Done)
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
    fn a_name_of_reruns_means_the_newest_that_is_done() {
        let job = |id: u64, result: &str, name: &str, state: &str| -> Job {
            let job = serde_json::json!({
                "id": id, "scan": "1-box", "result": result, "name": name, "state": state,
                "attempts": 1, "queued_at": "2026-11-21T09:30:00Z",
            });
            serde_json::from_value(job).unwrap()
        };
        let jobs = [
            job(4, "4-fine", "fine", "failed"),
            job(3, "3-fine", "fine", "done"),
            job(2, "2-fine", "fine", "done"),
            job(1, "1-box", "box", "done"),
        ];
        let result = |said| rerun(&jobs, said).map(|job| job.result.as_str());
        assert_eq!(result("fine"), Some("3-fine"));
        assert_eq!(result("2-fine"), None, "it names a result itself");
        assert_eq!(result("fin"), None);
    }

    #[test]
    fn an_identifier_beats_a_name() {
        let scans = [scan("2-x", "1-x"), scan("1-x", "x")];
        assert_eq!(meant(&scans, "1-x").unwrap().id, "1-x");
    }
}
