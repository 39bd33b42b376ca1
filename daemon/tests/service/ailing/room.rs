//! What is done when room is short.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, SystemTime};

use redb::ReadableTable;
use relief_api::{
    Event, Job, JobState, PlanRequest, Scan, ScanState, SpoolEntry, StartScan, Status,
    WebhookEvent, path,
};
use rustix::io::Errno;

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::{Rig, ended, json};
use crate::webhooks::receiver::Receiver;
use crate::webhooks::webhook;

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

#[tokio::test(flavor = "multi_thread")]
async fn little_room_is_told_once_until_there_is_enough_again() {
    let receiver = Receiver::new([]);
    let folder = tempfile::tempdir().unwrap();
    let mut lab = webhook(folder.path(), "lab", &receiver.url());
    lab.events = vec![WebhookEvent::DiskLow];
    let (rig, disk) = super::rig(|config| {
        config.storage.low_mb = 500;
        config.webhooks = vec![lab];
    })
    .await;
    let looked = async |free_bytes: u64| {
        disk.has_free(free_bytes);
        // Twice, so that it has been thought about once.
        for _ in 0..2 {
            let looks = disk.looks();
            while disk.looks() < looks + 2 {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
    };
    looked(499_000_000).await;
    let told = receiver.next().message();
    assert_eq!(told.event, WebhookEvent::DiskLow);
    let disk_low = told.data.disk.unwrap();
    assert_eq!(
        (disk_low.free_bytes, disk_low.low_bytes),
        (499_000_000, 500_000_000)
    );
    let state = rig.folder.path().join("state/scans");
    assert_eq!(disk_low.folder, state.display().to_string());
    for free_bytes in [520_000_000, 499_000_000] {
        looked(free_bytes).await;
    }
    receiver.is_quiet();
    looked(550_000_000).await;
    looked(400_000_000).await;
    let again = receiver.next().message().data.disk.unwrap();
    assert_eq!(again.free_bytes, 400_000_000);
    receiver.is_quiet();
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
const WITH_STEP: [&str; 4] = ["a.igs", "a.step", "manifest.json", "report.json"];

#[tokio::test(flavor = "multi_thread")]
async fn pictures_are_the_first_to_go_when_the_disk_is_full() {
    let (rig, disk) = super::rig(|_| {}).await;
    // One of them cannot be made, or finds no room.
    for (picture, only_writes) in [
        ("residuals.png", false),
        ("residuals.png", true),
        ("view.glb", true),
    ] {
        if only_writes {
            disk.refuse_writes(picture, Errno::NOSPC);
        } else {
            disk.refuse(picture, Errno::NOSPC);
        }
        let (scan, _) = rig.scan_to_result("a").await;
        let (names, warnings) = result(&rig, &scan.id).await;
        assert_eq!(names, WITH_STEP);
        assert!(
            warnings.contains("the pictures and the view in three dimensions were left out"),
            "{warnings}"
        );
        disk.heal();
    }
    // Then the page, which tells what other files hold.
    for page in ["report.html", "report.pdf"] {
        disk.refuse_writes(page, Errno::NOSPC);
        let (scan, _) = rig.scan_to_result("a").await;
        let (names, warnings) = result(&rig, &scan.id).await;
        assert_eq!(names.len(), WITH_STEP.len() + 5, "{names:?}");
        assert!(
            !names
                .iter()
                .any(|name| name.ends_with("html") || name.ends_with("pdf"))
        );
        assert!(warnings.contains("the page was left out"), "{warnings}");
        disk.heal();
    }
    // Then the second CAD file, whose model is in the first.
    disk.refuse_writes("a.step", Errno::NOSPC);
    let (scan, _) = rig.scan_to_result("a").await;
    let (names, warnings) = result(&rig, &scan.id).await;
    assert_eq!(names.len(), BARE.len() + 5 + 2);
    assert!(!names.contains(&"a.step".to_owned()), "{names:?}");
    assert!(warnings.contains("STEP file was left out"), "{warnings}");
    disk.heal();
    let (scan, _) = rig.scan_to_result("a").await;
    let (names, warnings) = result(&rig, &scan.id).await;
    assert_eq!(names.len(), WITH_STEP.len() + 5 + 2);
    assert!(!warnings.contains("left out"), "{warnings}");
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
    assert!(
        warnings.contains("the pictures and the view in three dimensions were left out"),
        "{warnings}"
    );
    assert!(warnings.contains("the page was left out"), "{warnings}");
    assert!(warnings.contains("STEP file was left out"), "{warnings}");
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
    let kept = std::fs::metadata(rig.journal(&new.id)).unwrap();
    assert_eq!(status.storage.unwrap().scans_bytes, kept.blocks() * 512);
    rig.daemon.shutdown().await;
}

/// Changes a record behind the back of a service that has ended.
fn change_record<'k, K: redb::Key + 'static>(
    folder: &Path,
    table: &str,
    key: K::SelfType<'k>,
    change: impl FnOnce(&mut serde_json::Value),
) {
    let table = redb::TableDefinition::<K, &[u8]>::new(table);
    let records = redb::Database::open(folder.join("state/reliefd.redb")).unwrap();
    let transaction = records.begin_write().unwrap();
    {
        let mut rows = transaction.open_table(table).unwrap();
        let kept = rows.get(&key).unwrap().unwrap().value().to_vec();
        let mut kept: serde_json::Value = serde_json::from_slice(&kept).unwrap();
        change(&mut kept["record"]);
        let kept = serde_json::to_vec(&kept).unwrap();
        rows.insert(&key, kept.as_slice()).unwrap();
    }
    transaction.commit().unwrap();
}

fn year_ago() -> String {
    (jiff::Timestamp::now() - jiff::SignedDuration::from_hours(24 * 365)).to_string()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_journal_that_is_put_back_can_be_run_again_and_is_as_young_as_that() {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("a").await;
    let journal = rig.journal(&scan.id);
    let aside = rig.folder.path().join("aside");
    std::fs::copy(&journal, &aside).unwrap();
    rig.daemon.shutdown().await;
    // As if it had been taken a year ago.
    let year_ago = year_ago();
    change_record::<&str>(rig.folder.path(), "scans", &scan.id, |record| {
        record["ended_at"] = year_ago.clone().into();
    });
    let month = |config: &mut reliefd::Config| config.storage.scans_days = Some(30);
    let rig = Rig::start(rig.folder, month).await;
    let gone: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert!(gone.removed_at.is_some() && !journal.exists());

    // While the service runs ...
    std::fs::copy(&aside, &journal).unwrap();
    let mut events = rig.client.events().await;
    let job: Job = rig.client.ask(&path::scan_rerun(&scan.id)).await;
    let job = crate::rig::job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    // ... and across a start, which looks for what is too old.
    rig.daemon.shutdown().await;
    let rig = Rig::start(rig.folder, month).await;
    let back: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert!(journal.exists() && back.removed_at.is_none() && back.put_back_at.is_some());
    assert_eq!(back.ended_at.as_deref(), Some(year_ago.as_str()));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_disk_that_hangs_keeps_nobody_from_the_status() {
    let (rig, disk) = super::rig(|_| {}).await;
    disk.hang().await;
    let status = async {
        let status: Status = rig.client.get(path::STATUS).await;
        assert!(status.storage.unwrap().scans_free_bytes.is_some());
        rig.client.events().await;
    };
    // Far longer than an answer takes.
    let answered = tokio::time::timeout(std::time::Duration::from_secs(60), status).await;
    disk.heal();
    assert!(answered.is_ok(), "the status waits for the disk");
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

#[tokio::test(flavor = "multi_thread")]
async fn results_go_when_their_days_are_over() {
    let rig = Rig::new().await;
    let (old, job) = rig.scan_to_result("a").await;
    let (new, _) = rig.scan_to_result("b").await;
    rig.daemon.shutdown().await;
    change_record::<u64>(rig.folder.path(), "jobs", job.id, |record| {
        record["ended_at"] = year_ago().into();
    });
    let rig = Rig::start(rig.folder, |config| config.storage.results_days = Some(30)).await;
    let folder = |scan: &Scan| rig.daemon.spool_dir().join(&scan.id);
    assert!(!folder(&old).exists() && folder(&new).exists());
    assert!(rig.journal(&old.id).exists());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_whose_job_failed_outlives_its_days() {
    let rig = Rig::new().await;
    let (failed, job) = rig.scan_to_result("a").await;
    let (done, _) = rig.scan_to_result("b").await;
    let (cancelled, other) = rig.scan_to_result("c").await;
    rig.daemon.shutdown().await;
    let folder = rig.folder.path();
    for scan in [&failed, &done, &cancelled] {
        change_record::<&str>(folder, "scans", &scan.id, |record| {
            record["ended_at"] = year_ago().into();
        });
    }
    for (id, state) in [(job.id, "failed"), (other.id, "cancelled")] {
        change_record::<u64>(folder, "jobs", id, |record| record["state"] = state.into());
    }
    let rig = Rig::start(rig.folder, |config| config.storage.scans_days = Some(30)).await;
    assert!(
        rig.journal(&failed.id).exists(),
        "nothing else is left of it"
    );
    assert!(!rig.journal(&done.id).exists());
    assert!(!rig.journal(&cancelled.id).exists());
    rig.daemon.shutdown().await;
}
