//! Disks that are full, read-only or broken, and records that are damaged.

mod damage;
pub(crate) mod disk;
mod room;

use std::sync::Arc;

use relief_api::{
    Event, Job, JobState, LaserEntry, LaserLog, Rerun, Scan, ScanState, StartScan, Status, path,
};
use reliefd::Config;
use rustix::io::Errno;
use scan_record::JournalReader;
use storage::HinderedDisk;

use crate::rig::{Rig, ended, job_over};
use disk::Ailing;

/// A service on a disk that does what it is told to.
pub(crate) async fn rig(change: impl FnOnce(&mut Config)) -> (Rig, Ailing) {
    let disk = Ailing::default();
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start_on(folder, Arc::new(HinderedDisk(disk.clone())), change).await;
    (rig, disk)
}

fn scan_request() -> String {
    serde_json::to_string(&StartScan::default()).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_disk_that_gets_full_in_mid_scan_costs_no_column_and_no_service() {
    let (rig, disk) = rig(|_| {}).await;
    rig.scanner.allow(20);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("full").await;
    events
        .until(|event| matches!(event, Event::Column { columns: 20, .. }).then_some(()))
        .await;
    disk.refuse(".scan", Errno::NOSPC);
    rig.scanner.allow_all();
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Failed);
    let reason = scan.reason.unwrap();
    assert!(
        reason.contains("cannot write the scan journal: No space left on device"),
        "{reason}"
    );
    rig.scanner.laser_goes_off();
    let mut reader = JournalReader::open(&rig.journal(&scan.id)).unwrap();
    while reader.next_column().unwrap().is_some() {}
    let acknowledged = rig.scanner.acknowledged().len() as u32;
    assert_eq!((reader.columns(), acknowledged), (20, 20));

    disk.heal();
    rig.scan_to_result("next").await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_read_only_disk_refuses_work_and_nothing_else() {
    let (rig, disk) = rig(|_| {}).await;
    let (scan, _) = rig.scan_to_result("before").await;
    disk.refuse("", Errno::ROFS);
    for _ in 0..2 {
        let reply = rig
            .client
            .request("POST", path::SCANS, Some(&scan_request()))
            .await;
        let problem = reply.problem();
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (500, "records-unusable")
        );
        assert!(
            problem.detail.contains("Read-only file system"),
            "{problem:?}"
        );
        assert!(problem.hint.unwrap().contains("writable"));
    }
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.scan, None);
    assert!(!rig.scanner.laser_is_on());

    disk.heal();
    let kept: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert_eq!(kept.state, ScanState::Complete);
    rig.scan_to_result("after").await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_is_not_complete_before_its_job_is_there() {
    let (rig, disk) = rig(|_| {}).await;
    rig.scanner.allow(30);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("a").await;
    events
        .until(|event| matches!(event, Event::Column { columns: 30, .. }).then_some(()))
        .await;
    disk.stall(".redb");
    rig.scanner.allow_all();
    disk.is_waited_for().await;
    let seen: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert_eq!(seen.state, ScanState::Scanning);
    disk.heal();
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.jobs.len()), (ScanState::Complete, 1));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_whose_record_is_refused_is_kept_and_processed_later() {
    let (rig, disk) = rig(|_| {}).await;
    rig.scanner.allow(30);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("a").await;
    events
        .until(|event| matches!(event, Event::Column { columns: 30, .. }).then_some(()))
        .await;
    disk.refuse(".redb", Errno::IO);
    rig.scanner.allow_all();
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.jobs.len()), (ScanState::Complete, 0));
    disk.heal();
    let kept = ended(&mut events, &scan.id).await;
    let job = job_over(&mut events, &rig, kept.jobs[0]).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_record_is_refused_is_published_once_all_the_same() {
    let (rig, disk) = rig(|_| {}).await;
    let (scan, _) = rig.scan_to_result("a").await;
    let mut events = rig.client.events().await;
    // Not before, since the record is also kept when the job begins, and by no word of this test,
    // which may come only when the job is done.
    disk.refuse_from_result_on(".redb", Errno::IO);
    let job: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    let published = |event: &Event| match event {
        Event::Progress {
            job: id,
            stage,
            seconds,
            ..
        } if *id == job.id && stage == "publish" => *seconds,
        _ => None,
    };
    events.until(published).await;
    let place = rig.daemon.spool_dir().join(&job.result);
    let before = std::fs::metadata(&place).unwrap();
    disk.has_refused().await;
    disk.heal();
    let (seen, ()) = events
        .until(|event| match event {
            Event::Published { job: id, .. } if *id == job.id => Some(()),
            _ => None,
        })
        .await;
    let told = seen.iter().filter(|e| matches!(e, Event::Published { .. }));
    assert_eq!(told.count(), 1);
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(
        (job.state, job.attempts),
        (JobState::Done, 1),
        "{:?}",
        job.error
    );
    let after = std::fs::metadata(&place).unwrap();
    assert_eq!(before.modified().unwrap(), after.modified().unwrap());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_result_whose_name_is_not_safe_is_not_told_as_done() {
    let (rig, disk) = rig(|_| {}).await;
    let mut events = rig.client.events().await;
    disk.refuse("spool", Errno::IO);
    let scan = rig.start_scan("a").await;
    let scan = ended(&mut events, &scan.id).await;
    let job = job_over(&mut events, &rig, scan.jobs[0]).await;
    // It has its name by now, which the power might still take back.
    assert!(rig.daemon.spool_dir().join(&job.result).is_dir());
    for attempt in 1..=2 {
        let job = job_over(&mut events, &rig, job.id).await;
        assert_eq!((job.state, job.attempts), (JobState::Failed, attempt));
        let error = job.error.unwrap();
        assert!(error.starts_with("cannot sync the folder"), "{error}");
        if attempt == 2 {
            disk.heal();
        }
        let _: Job = rig.client.ask(&path::job_retry(job.id)).await;
    }
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_laser_log_is_made_up_for_once_the_disk_takes_it() {
    let (rig, disk) = rig(|_| {}).await;
    rig.scan_to_result("a").await;
    disk.refuse_writes(".jsonl", Errno::NOSPC);
    let (unlogged, _) = rig.scan_to_result("b").await;
    disk.heal();
    rig.scan_to_result("c").await;
    let shown: LaserLog = rig.client.get(path::LASER).await;
    rig.daemon.shutdown().await;
    let text = std::fs::read_to_string(rig.folder.path().join("state/laser.jsonl")).unwrap();
    let written: Vec<LaserEntry> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(written, shown.entries);
    let of_it = written
        .iter()
        .filter(|e| e.scan.as_ref() == Some(&unlogged.id));
    assert!(of_it.count() >= 2, "{text}");
}
