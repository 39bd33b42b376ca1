//! What is done when room is short.

use std::time::{Duration, SystemTime};

use relief_api::{Event, PlanRequest, Scan, ScanState, SpoolEntry, StartScan, Status, path};
use rustix::io::Errno;

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::{Rig, ended, json};

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_without_room_is_refused_with_the_figures() {
    let (rig, disk) = super::rig(|config| config.storage.reserve_mb = 100).await;
    disk.has_free(100_100_000);
    let reply = rig
        .client
        .request("POST", path::SCANS, Some(&super::scan_request()))
        .await;
    let problem = reply.problem();
    assert_eq!((problem.status, problem.kind.as_str()), (507, "no-room"));
    let journal = scan_record::most_bytes(COLUMNS, SAMPLES.into()) as f64 * 1e-6;
    assert!(journal > 0.1, "{journal}");
    assert!(
        problem.detail.ends_with(&format!(
            "the scan takes up to {journal:.1} MB, and 100.0 MB are to stay free \
             (storage.reserve_mb), but only 100.1 MB are free"
        )),
        "{}",
        problem.detail
    );
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.scan, None);
    let storage = status.storage.unwrap();
    assert_eq!(
        (storage.scans_free_bytes, storage.reserve_bytes),
        (Some(100_100_000), 100_000_000)
    );
    disk.has_free(100_200_000);
    rig.scan_to_result("a").await;
    rig.daemon.shutdown().await;
}

/// Names in the spool's folder of a result, and the warnings of its report.
async fn result(rig: &Rig, scan: &str) -> (Vec<String>, String) {
    let entry: SpoolEntry = rig.client.get(&path::spool(scan)).await;
    let report = json(&rig.daemon.spool_dir().join(scan).join("report.json"));
    let names = entry.files.into_iter().map(|file| file.name).collect();
    (names, report["warnings"].to_string())
}

const BARE: [&str; 3] = ["a.igs", "manifest.json", "report.json"];

#[tokio::test(flavor = "multi_thread")]
async fn pictures_are_the_first_to_go_when_the_disk_is_full() {
    let (rig, disk) = super::rig(|_| {}).await;
    // The third of four does not fit.
    disk.refuse("residuals.png", Errno::NOSPC);
    let (scan, _) = rig.scan_to_result("a").await;
    let (names, warnings) = result(&rig, &scan.id).await;
    assert_eq!(names, BARE);
    assert!(warnings.contains("pictures were left out"), "{warnings}");
    disk.heal();
    let (scan, _) = rig.scan_to_result("a").await;
    let (names, warnings) = result(&rig, &scan.id).await;
    assert_eq!(names.len(), BARE.len() + 4);
    assert!(!warnings.contains("pictures"), "{warnings}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_reserve_is_for_scans_and_not_for_pictures() {
    let (rig, disk) = super::rig(|config| config.storage.reserve_mb = 100).await;
    rig.scanner.allow(10);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("a").await;
    events
        .until(|event| matches!(event, Event::Column { columns: 10, .. }).then_some(()))
        .await;
    disk.has_free(1_000_000);
    rig.scanner.allow_all();
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Complete, "{:?}", scan.reason);
    crate::rig::job_over(&mut events, &rig, scan.jobs[0]).await;
    let (names, warnings) = result(&rig, &scan.id).await;
    assert_eq!(names, BARE);
    assert!(warnings.contains("pictures were left out"), "{warnings}");
    rig.daemon.shutdown().await;
}

/// A scan of more than a megabyte that ends early, so that it has no job.
async fn large(rig: &Rig) -> Scan {
    rig.scanner.fault_after(120);
    let request = StartScan {
        plan: PlanRequest {
            columns: Some(140),
            pitch_mm: Some(0.5),
            samples: Some(1_000),
            ..PlanRequest::default()
        },
        ..StartScan::default()
    };
    let mut events = rig.client.events().await;
    let scan: Scan = rig.client.post(path::SCANS, &request).await;
    ended(&mut events, &scan.id).await
}

#[tokio::test(flavor = "multi_thread")]
async fn the_oldest_scans_go_when_all_take_more_than_they_may() {
    let rig = Rig::new().await;
    let old = large(&rig).await;
    let new = large(&rig).await;
    assert_eq!((old.columns, new.columns), (120, 120));
    rig.daemon.shutdown().await;
    let rig = Rig::start(rig.folder, |config| config.storage.scans_mb = Some(2)).await;
    let old: Scan = rig.client.get(&path::scan(&old.id)).await;
    let new: Scan = rig.client.get(&path::scan(&new.id)).await;
    assert!(old.removed_at.is_some() && new.removed_at.is_none());
    assert!(!rig.journal(&old.id).exists() && rig.journal(&new.id).exists());
    let reply = rig
        .client
        .request("POST", &path::scan_rerun(&old.id), None)
        .await;
    let problem = reply.problem();
    assert_eq!(problem.kind, "nothing-kept");
    assert!(problem.detail.contains("were removed at"), "{problem:?}");
    let status: Status = rig.client.get(path::STATUS).await;
    let kept = std::fs::metadata(rig.journal(&new.id)).unwrap().len();
    assert_eq!(status.storage.unwrap().scans_bytes, kept);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_oldest_results_go_when_all_take_more_than_they_may() {
    let rig = Rig::new().await;
    let (old, _) = rig.scan_to_result("a").await;
    let (new, _) = rig.scan_to_result("b").await;
    let folder = |rig: &Rig, scan: &Scan| rig.daemon.spool_dir().join(&scan.id);
    // As if it had grown since: a folder that was written to last is not the younger result.
    std::fs::write(folder(&rig, &old).join("filler"), vec![0; 1_000_000]).unwrap();
    let hour_ago = SystemTime::now() - Duration::from_secs(3_600);
    let newer = std::fs::File::open(folder(&rig, &new)).unwrap();
    newer.set_modified(hour_ago).unwrap();
    rig.daemon.shutdown().await;
    let rig = Rig::start(rig.folder, |config| config.storage.results_mb = Some(1)).await;
    assert!(!folder(&rig, &old).exists() && folder(&rig, &new).exists());
    let names = std::fs::read_dir(rig.daemon.spool_dir()).unwrap().count();
    assert_eq!(names, 1);
    // The scan itself is kept, and its job is not done again.
    let kept: Scan = rig.client.get(&path::scan(&old.id)).await;
    assert!(kept.removed_at.is_none() && rig.journal(&old.id).exists());
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.jobs_queued + status.jobs_running, 0);
    rig.daemon.shutdown().await;
}
