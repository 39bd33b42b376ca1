use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::channel;

use relief_api::{
    Event, Job, JobList, JobState, Rerun, Scan, ScanList, ScanState, SpoolEntry, StartScan, path,
};
use scan_record::{EndCause, Ending, JournalReader};
use storage::{Deed, HinderedDisk, Hindrance};

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::{Rig, ended, job_over, json};

fn read_journal(path: &Path) -> (u32, Ending) {
    let mut reader = JournalReader::open(path).unwrap();
    while reader.next_column().unwrap().is_some() {}
    (reader.columns(), reader.ending().unwrap().clone())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_becomes_a_result_in_the_spool() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let request = StartScan {
        name: "Gable roof".into(),
        part: "P-17".into(),
        operator: "M. Mason".into(),
        note: "first try".into(),
        ..StartScan::default()
    };
    let scan: Scan = rig.client.post(path::SCANS, &request).await;
    assert!(scan.id.ends_with("-Gable-roof"), "{}", scan.id);
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(
        (scan.state, scan.columns, scan.columns_planned),
        (ScanState::Complete, COLUMNS, COLUMNS)
    );
    let job = job_over(&mut events, &rig, scan.jobs[0]).await;
    assert_eq!((job.state, job.attempts), (JobState::Done, 1));
    assert_eq!(job.result, scan.id);

    let directory = rig.daemon.spool_dir().join(&scan.id);
    assert_eq!(job.directory.as_deref(), directory.to_str());
    let entry: SpoolEntry = rig.client.get(&path::spool(&scan.id)).await;
    let names: Vec<&str> = entry.files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "Gable roof.igs",
            "Gable roof.step",
            "inliers.png",
            "manifest.json",
            "range.png",
            "regions.png",
            "report.html",
            "report.json",
            "report.pdf",
            "residuals.png",
            "view.glb"
        ]
    );
    let report = json(&directory.join("report.json"));
    assert_eq!(report["name"], "Gable roof");
    assert_eq!(report["scan"]["operator"], "M. Mason");
    assert_eq!(report["scan"]["part"], "P-17");
    assert_eq!(report["scan"]["note"], "first try");
    assert_eq!(report["scan"]["source"], "Fake, serial number F-1");
    assert_eq!(report["scan"]["columns"], COLUMNS);
    assert_eq!(report["scan"]["samples"], COLUMNS * u32::from(SAMPLES));
    assert_eq!(report["scan"]["dropouts"], COLUMNS * 2);
    assert_eq!(report["regions"]["count"], 2, "a roof has two sides");

    let file = rig
        .client
        .request("GET", &path::spool_file(&scan.id, "Gable roof.igs"), None)
        .await;
    assert_eq!(file.header("content-type"), Some("model/iges"));
    assert_eq!(
        file.body,
        std::fs::read(directory.join("Gable roof.igs")).unwrap()
    );
    let manifest = json(&directory.join("manifest.json"));
    assert_eq!(manifest["files"][0]["name"], "Gable roof.igs");
    assert_eq!(manifest["files"][0]["bytes"], file.body.len());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_column_is_on_disk_before_it_is_acknowledged() {
    let rig = Rig::new().await;
    let scans = rig.folder.path().join("state/scans");
    let checked = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&checked);
    rig.scanner.on_acknowledge(move |index| {
        let journal = std::fs::read_dir(&scans)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .find(|path| path.extension().is_some_and(|e| e == "scan"))
            .unwrap();
        let (columns, _) = read_journal(&journal);
        assert!(columns > index, "column {index} of {columns}");
        count.fetch_add(1, Ordering::Relaxed);
    });
    rig.scan_to_result("a").await;
    assert_eq!(checked.load(Ordering::Relaxed), COLUMNS);
    assert_eq!(rig.scanner.acknowledged(), (0..COLUMNS).collect::<Vec<_>>());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_abort_just_before_the_start_still_holds() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let ((reached, at_start), (go, leave)) = (channel(), channel());
    rig.scanner.on_start(move || {
        reached.send(()).unwrap();
        leave.recv().unwrap();
    });
    let scan = rig.start_scan("early").await;
    at_start.recv().unwrap();
    let _: Scan = rig.client.ask(&path::scan_abort(&scan.id)).await;
    go.send(()).unwrap();
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!((scan.state, scan.columns), (ScanState::Aborted, 0));
    assert_eq!(scan.reason.as_deref(), Some("aborted on request"));
    assert!(rig.scanner.acknowledged().is_empty());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_defect_in_one_scan_leaves_room_for_the_next() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    rig.scanner
        .on_start(|| panic!("a defect made for this test"));
    let scan = rig.start_scan("broken").await;
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Failed);
    let reason = scan.reason.unwrap();
    assert!(reason.contains("a defect made for this test"), "{reason}");
    rig.scan_to_result("next").await;
    rig.daemon.shutdown().await;
}

/// Has a defect when a journal is synced for this number of times.
#[derive(Debug, Clone)]
struct Defect(Arc<AtomicU32>);

impl Hindrance for Defect {
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()> {
        let is_journal = path.extension().is_some_and(|e| e == "scan");
        if deed == Deed::SyncFile && is_journal {
            let left = self.0.fetch_sub(1, Ordering::Relaxed);
            assert!(left != 1, "a defect made for this test");
        }
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_defect_in_mid_scan_turns_the_laser_off_and_keeps_the_columns() {
    const SYNCED: u32 = 6;
    let disk = HinderedDisk(Defect(Arc::new(AtomicU32::new(u32::MAX))));
    let left = Arc::clone(&disk.0.0);
    let every_column = |config: &mut reliefd::Config| config.journal.sync_columns = 1;
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start_on(folder, Arc::new(disk), every_column).await;
    let mut events = rig.client.events().await;
    rig.scanner.allow(SYNCED);
    let scan = rig.start_scan("broken").await;
    let at = |event: &Event| {
        matches!(
            event,
            Event::Column {
                columns: SYNCED,
                ..
            }
        )
        .then_some(())
    };
    events.until(at).await;
    assert!(rig.scanner.laser_is_on());
    // One more column comes, and no other: whoever feeds them waits for the next one.
    left.store(1, Ordering::Relaxed);
    rig.scanner.allow(SYNCED + 1);
    let scan = ended(&mut events, &scan.id).await;
    rig.scanner.laser_goes_off();
    assert_eq!(scan.state, ScanState::Failed);
    let reason = scan.reason.unwrap();
    assert!(reason.contains("a defect made for this test"), "{reason}");
    let (columns, ending) = read_journal(&rig.journal(&scan.id));
    assert!(columns >= SYNCED, "{columns}");
    assert!(matches!(ending, Ending::Closed(EndCause::Fault(_))));
    rig.scanner.allow(COLUMNS);
    rig.scan_to_result("next").await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_aborted_scan_is_kept_and_can_be_run() {
    let rig = Rig::new().await;
    rig.scanner.allow(30);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("half").await;
    let at_column_30 =
        |event: &Event| matches!(event, Event::Column { columns: 30, .. }).then_some(());
    events.until(at_column_30).await;
    assert!(rig.scanner.laser_is_on());
    let _: Scan = rig.client.ask(&path::scan_abort(&scan.id)).await;
    let scan = ended(&mut events, &scan.id).await;
    rig.scanner.laser_goes_off();
    assert_eq!((scan.state, scan.columns), (ScanState::Aborted, 30));
    assert_eq!(scan.reason.as_deref(), Some("aborted on request"));
    assert_eq!(
        read_journal(&rig.journal(&scan.id)),
        (
            30,
            Ending::Closed(EndCause::Aborted("aborted on request".into()))
        )
    );
    let jobs: JobList = rig.client.get(path::JOBS).await;
    assert_eq!(jobs.jobs, [], "no job by itself");

    let job: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    let report = json(&rig.daemon.spool_dir().join(&job.result).join("report.json"));
    assert_eq!(report["scan"]["columns"], 30);
    assert_eq!(
        report["warnings"][0],
        "the scan is aborted: aborted on request"
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fault_in_mid_scan_is_named_and_the_columns_are_kept() {
    let rig = Rig::new().await;
    rig.scanner.fault_after(12);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("").await;
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!((scan.state, scan.columns), (ScanState::Failed, 12));
    assert_eq!(
        scan.reason.as_deref(),
        Some("the scanner reports: table stalled")
    );
    let kept = rig
        .client
        .request("GET", &path::scan_journal(&scan.id), None)
        .await;
    let mut reader = JournalReader::new(kept.body.as_slice()).unwrap();
    while reader.next_column().unwrap().is_some() {}
    assert_eq!(reader.columns(), 12);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn stopping_the_service_ends_its_scan_with_the_laser_off() {
    let rig = Rig::new().await;
    rig.scanner.allow(5);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("cut").await;
    events
        .until(|event| matches!(event, Event::Column { columns: 5, .. }).then_some(()))
        .await;
    let scanner = Arc::clone(&rig.scanner);
    let rig = rig.restart().await;
    scanner.laser_goes_off();
    while events.next().await.is_some() {}
    let list: ScanList = rig.client.get(path::SCANS).await;
    assert_eq!(list.scans.len(), 1);
    assert_eq!(list.scans[0].id, scan.id);
    assert_eq!(list.scans[0].state, ScanState::Aborted);
    assert_eq!(
        list.scans[0].reason.as_deref(),
        Some("the service was stopped")
    );
    assert_eq!(list.scans[0].columns, 5);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_can_follow_another_at_once() {
    let mut rig = Rig::new().await;
    let mut streams = Vec::new();
    for round in 0..40 {
        // Open streams, one of which nobody reads; on every other round a scan under way.
        let mut events = rig.client.events().await;
        streams.push(rig.client.events().await);
        if round % 2 == 0 {
            rig.scanner.allow(2);
            rig.start_scan("cut").await;
            events
                .until(|event| matches!(event, Event::Column { columns: 2, .. }).then_some(()))
                .await;
        }
        rig.daemon.shutdown().await;
        // Without any waiting: what has ended holds nothing.
        let store = redb::Database::create(rig.folder.path().join("state/reliefd.redb"));
        drop(store.unwrap());
        rig = Rig::start(rig.folder, |_| {}).await;
    }
    let list: ScanList = rig.client.get(path::SCANS).await;
    assert_eq!(list.scans.len(), 20);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn streamed_and_regridded_give_the_same_bytes() {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("same").await;
    let mut events = rig.client.events().await;
    // The streamed range image is gone by now, so this regrids from the journal.
    let job: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert!(job.timings.iter().any(|timing| timing.stage == "regrid"));
    let file = |result: &str, name: &str| {
        std::fs::read(rig.daemon.spool_dir().join(result).join(name)).unwrap()
    };
    for name in ["same.igs", "same.step", "range.png", "regions.png"] {
        assert_eq!(file(&scan.id, name), file(&job.result, name), "{name}");
    }
    rig.daemon.shutdown().await;
}
