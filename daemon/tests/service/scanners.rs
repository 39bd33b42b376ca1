//! Several scanners: each on its own, whatever the others do.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use relief_api::{
    Aborted, Event, Job, JobState, LaserEntry, LaserLog, LaserState, Problem, Rerun, Scan,
    ScanList, ScanState, ScannerLink, ScannerList, ScannerSummary, StartScan, Status, path,
};
use reliefd::Config;
use reliefd::config::ScannerConfig;
use scan_record::JournalReader;
use scanner_driver::ScannerError;

use crate::client::Events;
use crate::fake::COLUMNS;
use crate::rig::{Rig, ended, job_over, json};

/// Nothing here takes as long, unless it hangs.
const GUARD: Duration = Duration::from_secs(60);

fn left_and_right(config: &mut Config) {
    for name in ["left", "right"] {
        let scanner = ScannerConfig {
            port: format!("/dev/{name}").into(),
            ..ScannerConfig::default()
        };
        config.scanners.insert(name.into(), scanner);
    }
}

async fn rig() -> Rig {
    Rig::start(tempfile::tempdir().unwrap(), left_and_right).await
}

fn on(scanner: &str) -> StartScan {
    StartScan {
        name: format!("at {scanner}"),
        scanner: scanner.into(),
        ..StartScan::default()
    }
}

/// A scan on each scanner, with this many columns on disk.
async fn amid(columns: u32) -> (Rig, Events, Scan, Scan) {
    let rig = rig().await;
    let mut events = rig.client.events().await;
    let mut scans = Vec::new();
    for name in ["left", "right"] {
        rig.of(name).allow(columns);
        let scan: Scan = rig.client.post(path::SCANS, &on(name)).await;
        scans.push(scan);
    }
    let mut waiting = vec!["left", "right"];
    let there = |event: &Event| {
        if let Event::Column {
            scanner,
            columns: n,
            ..
        } = event
            && *n == columns
        {
            waiting.retain(|name| name != scanner);
        }
        waiting.is_empty().then_some(())
    };
    events.until(there).await;
    let [left, right] = scans.try_into().unwrap();
    (rig, events, left, right)
}

/// Waits for a scan's end, which may hang on another scanner if the service is broken.
async fn ended_in_time(events: &mut Events, scan: &Scan) -> Scan {
    tokio::time::timeout(GUARD, ended(events, &scan.id))
        .await
        .expect("it waits for no other scanner")
}

async fn refused(rig: &Rig, method: &str, path: &str, body: Option<&str>) -> Problem {
    rig.client.request(method, path, body).await.problem()
}

/// Columns in a scan's journal.
fn columns(rig: &Rig, scan: &Scan) -> u32 {
    let mut reader = JournalReader::open(&rig.journal(&scan.id)).unwrap();
    let begun: Scan = serde_json::from_slice(&reader.header().metadata).unwrap();
    assert_eq!(begun.scanner, scan.scanner, "the journal names the scanner");
    while reader.next_column().unwrap().is_some() {}
    reader.columns()
}

fn logged(folder: &Path, file: &str) -> Vec<LaserEntry> {
    let text = std::fs::read_to_string(folder.join("state").join(file)).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn two_scanners_scan_at_once_and_each_result_names_its_own() {
    let (rig, mut events, left, right) = amid(30).await;
    let status: Status = rig.client.get(path::STATUS).await;
    let told = |one: &ScannerSummary| {
        let scan = one.scan.clone().unwrap();
        assert_eq!(one.laser.as_ref().unwrap().laser, LaserState::On);
        (
            one.status.name.clone(),
            one.status.link,
            scan.id,
            scan.columns,
        )
    };
    let expected = [("left", &left), ("right", &right)]
        .map(|(name, scan)| (name.to_owned(), ScannerLink::Scanning, scan.id.clone(), 30));
    assert_eq!(
        status.scanners.iter().map(told).collect::<Vec<_>>(),
        expected
    );
    // The keys of old are the first scanner's.
    assert_eq!(status.scanner, status.scanners[0].status);
    assert_eq!((status.scan, status.laser), {
        let first = status.scanners[0].clone();
        (first.scan, first.laser)
    });
    let list: ScannerList = rig.client.get(path::SCANNERS).await;
    assert_eq!(list.scanners, status.scanners);
    let one: ScannerSummary = rig.client.get(&path::scanner("right")).await;
    assert_eq!(one, status.scanners[1]);
    assert_eq!(one.status.endpoint, "/dev/right");

    for name in ["left", "right"] {
        rig.of(name).allow_all();
    }
    let mut live = std::collections::BTreeMap::<String, usize>::new();
    let mut over = Vec::new();
    let both = |event: &Event| {
        match event {
            Event::Column {
                scan,
                scanner,
                live: finished,
                ..
            } => {
                let id = if scanner == "left" {
                    &left.id
                } else {
                    &right.id
                };
                assert_eq!(scan, id);
                *live.entry(scanner.clone()).or_default() += finished.len();
            }
            Event::Scan(scan) if scan.state.is_over() => over.push(scan.clone()),
            _ => {}
        }
        (over.len() == 2).then_some(())
    };
    events.until(both).await;
    assert!(
        live.len() == 2 && live.values().all(|&n| n > 0),
        "each grids while it scans: {live:?}"
    );
    let mut jobs = rig.client.events().await;
    for name in ["left", "right"] {
        let scan = over.iter().find(|scan| scan.scanner == name).unwrap();
        let rerun: Job = rig
            .client
            .post(&path::scan_rerun(&scan.id), &Rerun::default())
            .await;
        assert_eq!(rerun.scanner, name);
        let told = |event: &Event| {
            let (job, scanner) = match event {
                Event::Progress { job, scanner, .. } => (*job, scanner),
                Event::Published { job, scanner, .. } => (*job, scanner),
                Event::Job(job) => (job.id, &job.scanner),
                _ => return None,
            };
            if job == rerun.id {
                assert_eq!(scanner, name, "{event:?}");
            }
            (job == rerun.id && matches!(event, Event::Published { .. })).then_some(())
        };
        jobs.until(told).await;
    }
    for scan in over {
        assert_eq!((scan.state, scan.columns), (ScanState::Complete, COLUMNS));
        let job: Job = job_over(&mut events, &rig, scan.jobs[0]).await;
        assert_eq!(job.state, JobState::Done, "{:?}", job.error);
        assert_eq!(job.scanner, scan.scanner);
        let result = rig.daemon.spool_dir().join(&scan.id);
        let report = json(&result.join("report.json"));
        assert_eq!(report["scan"]["scanner"], scan.scanner.as_str());
        let manifest = json(&result.join("manifest.json"));
        assert_eq!(manifest["scanner"], scan.scanner.as_str());
        assert_eq!(scan.name, format!("at {}", scan.scanner));
        assert_eq!(columns(&rig, &scan), COLUMNS);
    }

    // Each laser has a log of its own; together they are told in the order of time.
    let folder = rig.folder.path();
    for scan in [&left, &right] {
        let name = &scan.scanner;
        let entries = logged(folder, &format!("laser-{name}.jsonl"));
        assert!(entries.iter().all(|entry| entry.scanner == *name));
        let on: Vec<&LaserEntry> = entries
            .iter()
            .filter(|e| e.laser == LaserState::On)
            .collect();
        assert_eq!(on.len(), 1);
        assert_eq!(on[0].scan.as_ref(), Some(&scan.id));
        let log: LaserLog = rig.client.get(&path::scanner_laser(name)).await;
        assert_eq!(log.entries, entries);
    }
    let all: LaserLog = rig.client.get(path::LASER).await;
    assert!(all.entries.is_sorted_by(|a, b| a.at <= b.at));
    let of_left = all.entries.iter().filter(|e| e.scanner == "left").count();
    assert_eq!(of_left, logged(folder, "laser-left.jsonl").len());
    assert!(of_left < all.entries.len());
    assert!(!folder.join("state/laser.jsonl").exists());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn trouble_on_one_scanner_leaves_the_scan_of_the_other_alone() {
    for trouble in ["fault", "lost", "hung"] {
        let (rig, mut events, left, right) = amid(10).await;
        let scanner = rig.of("left");
        let mut hung = None;
        match trouble {
            "fault" => {
                scanner.fault_after(10);
                scanner.allow_all();
            }
            "lost" => {
                scanner.fail_with(Some(ScannerError::Closed));
                scanner.fault_after(10);
                scanner.allow_all();
            }
            _ => hung = Some(scanner.hang()),
        }
        if trouble != "hung" {
            let left = ended(&mut events, &left.id).await;
            assert_eq!(
                (left.state, left.columns),
                (ScanState::Failed, 10),
                "{trouble}"
            );
        }
        rig.of("right").allow_all();
        let right = ended_in_time(&mut events, &right).await;
        assert_eq!(
            (right.state, right.columns, right.reason.as_deref()),
            (ScanState::Complete, COLUMNS, None),
            "{trouble}"
        );
        let job = job_over(&mut events, &rig, right.jobs[0]).await;
        assert_eq!(job.state, JobState::Done, "{trouble}: {:?}", job.error);
        assert_eq!(columns(&rig, &right), COLUMNS);

        let status: Status = rig.client.get(path::STATUS).await;
        let still = status.scanners[0].scan.as_ref().map(|scan| &scan.id);
        let expected = (trouble == "hung").then_some(&left.id);
        assert_eq!(still, expected, "{trouble}");
        // The scanner that is well takes another, whatever the other one is at.
        let again: Scan = rig.client.post(path::SCANS, &on("right")).await;
        let again = ended(&mut events, &again.id).await;
        assert_eq!(
            again.state,
            ScanState::Complete,
            "{trouble}: {:?}",
            again.reason
        );
        drop(hung);
        rig.daemon.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_abort_of_all_turns_the_laser_off_beside_a_scanner_that_hangs() {
    let (rig, mut events, left, right) = amid(10).await;
    let rig = Arc::new(rig);
    let hung = rig.of("left").hang();
    let asked = tokio::spawn({
        let rig = Arc::clone(&rig);
        async move { rig.client.ask::<Aborted>(path::ABORT).await }
    });
    // Only then does the other one answer.
    let over = ended_in_time(&mut events, &right).await;
    assert_eq!(
        (over.state, over.reason.as_deref()),
        (ScanState::Aborted, Some("aborted on request"))
    );
    rig.of("right").laser_goes_off();
    assert!(!asked.is_finished(), "it waits for the scanner that hangs");
    drop(hung);
    let aborted = asked.await.unwrap();
    assert_eq!(aborted.scan.id, left.id);
    assert_eq!(aborted.others.len(), 1);
    assert_eq!(aborted.others[0].id, right.id);
    ended(&mut events, &left.id).await;
    let rig = Arc::into_inner(rig).unwrap();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_scan_is_aborted_by_its_scanner_and_the_other_goes_on() {
    let (rig, mut events, left, right) = amid(10).await;
    let asked: Scan = rig.client.ask(&path::scanner_abort("right")).await;
    assert_eq!(asked.id, right.id);
    let over = ended(&mut events, &right.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Aborted, 10));
    let idle = refused(&rig, "POST", &path::scanner_abort("right"), None).await;
    assert_eq!(
        (idle.status, idle.kind.as_str(), idle.detail.as_str()),
        (
            409,
            "nothing-to-abort",
            "the scanner right is taking no scan"
        )
    );
    assert!(rig.of("left").laser_is_on());
    // Of one that runs it is that one.
    let last: Aborted = rig.client.ask(path::ABORT).await;
    assert_eq!((&last.scan.id, last.others.len()), (&left.id, 0));
    ended(&mut events, &left.id).await;
    let none = refused(&rig, "POST", path::ABORT, None).await;
    assert_eq!(none.detail, "no scan is under way");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scanner_is_meant_by_its_name_where_there_are_several() {
    let rig = rig().await;
    let unnamed = refused(&rig, "POST", path::SCANS, Some("{}")).await;
    assert_eq!(
        (unnamed.status, unnamed.kind.as_str()),
        (400, "which-scanner")
    );
    assert_eq!(
        unnamed.detail,
        "there are several scanners, and none is named: left, right"
    );
    assert!(unnamed.hint.unwrap().contains("--scanner"));
    let there_is_none = "there is no scanner up; there are left, right";
    for (method, path, body) in [
        ("POST", path::SCANS.to_owned(), Some(r#"{"scanner":"up"}"#)),
        ("GET", path::scanner("up"), None),
        ("GET", path::scanner_laser("up"), None),
        ("POST", path::scanner_abort("up"), None),
        ("POST", path::scanner_pause("up"), None),
        ("POST", path::scanner_resume("up"), None),
    ] {
        let unknown = refused(&rig, method, &path, body).await;
        assert_eq!(
            (
                unknown.status,
                unknown.kind.as_str(),
                unknown.detail.as_str()
            ),
            (404, "no-such-scanner", there_is_none),
            "{method} {path}"
        );
    }
    assert_eq!(rig.client.get::<ScanList>(path::SCANS).await.scans, []);

    // Trouble is told with the keys of the section that is meant.
    rig.of("right").fail_with(Some(ScannerError::NotAPort {
        port: "/dev/right".into(),
    }));
    let body = serde_json::to_string(&on("right")).unwrap();
    let trouble = refused(&rig, "POST", path::SCANS, Some(&body)).await;
    let hint = trouble.hint.unwrap();
    assert!(hint.contains("set scanners.right.port"), "{hint}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn each_scanner_is_busy_for_itself() {
    let (rig, mut events, left, right) = amid(5).await;
    for (name, scan) in [("left", &left), ("right", &right)] {
        let body = serde_json::to_string(&on(name)).unwrap();
        let busy = refused(&rig, "POST", path::SCANS, Some(&body)).await;
        assert_eq!(busy.kind, "scanner-busy");
        assert_eq!(
            busy.detail,
            format!("the scanner {name} is taking the scan {}", scan.id)
        );
    }
    rig.of("left").allow_all();
    ended(&mut events, &left.id).await;
    let next: Scan = rig.client.post(path::SCANS, &on("left")).await;
    ended(&mut events, &next.id).await;
    // To the end of the service: the other scan is kept as far as it came.
    let folder = {
        rig.daemon.shutdown().await;
        rig.folder
    };
    let last = logged(folder.path(), "laser-right.jsonl").pop().unwrap();
    assert_eq!(
        (last.laser, last.cause.as_str()),
        (LaserState::Off, "the service was stopped")
    );
    let rig = Rig::start(folder, left_and_right).await;
    let kept: Scan = rig.client.get(&path::scan(&right.id)).await;
    assert_eq!((kept.state, kept.columns), (ScanState::Aborted, 5));
    assert_eq!(kept.scanner, "right");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_end_of_the_service_waits_for_no_scanner_to_turn_off_another() {
    let (rig, mut events, _, right) = amid(10).await;
    let hung = rig.of("left").hang();
    let (left, other) = (Arc::clone(rig.of("left")), Arc::clone(rig.of("right")));
    let ending = tokio::spawn(rig.daemon.shutdown());
    ended_in_time(&mut events, &right).await;
    other.laser_goes_off();
    assert!(!ending.is_finished());
    drop(hung);
    ending.await.unwrap();
    left.laser_goes_off();
}

#[tokio::test(flavor = "multi_thread")]
async fn the_room_of_a_scan_that_begins_is_not_given_to_another() {
    let (rig, disk) = crate::ailing::rig(|config| {
        left_and_right(config);
        config.storage.reserve_mb = 100;
    })
    .await;
    let most = scan_record::most_bytes(COLUMNS, crate::fake::SAMPLES.into());
    // For one, and for most of another.
    disk.has_free(100_000_000 + 2 * most - 1);
    let mut events = rig.client.events().await;
    let (begun, begins) = channel();
    let (go_on, wait) = channel::<()>();
    rig.of("left").on_start(move || {
        begun.send(()).unwrap();
        // Its journal is not there yet, and has no room set aside.
        let _ = wait.recv_timeout(GUARD);
    });
    let left: Scan = rig.client.post(path::SCANS, &on("left")).await;
    tokio::task::block_in_place(|| begins.recv_timeout(GUARD).unwrap());
    let body = serde_json::to_string(&on("right")).unwrap();
    let no_room = refused(&rig, "POST", path::SCANS, Some(&body)).await;
    assert_eq!((no_room.status, no_room.kind.as_str()), (507, "no-room"));
    let megabytes = most as f64 * 1e-6;
    assert!(
        no_room.detail.ends_with(&format!(
            "of which scans under way take up to {megabytes:.1} MB"
        )),
        "{}",
        no_room.detail
    );
    disk.has_free(100_000_000 + 2 * most);
    let right: Scan = rig.client.post(path::SCANS, &on("right")).await;
    ended(&mut events, &right.id).await;
    go_on.send(()).unwrap();
    ended(&mut events, &left.id).await;
    // What was promised is free again.
    disk.has_free(100_000_000 + most);
    let again: Scan = rig.client.post(path::SCANS, &on("left")).await;
    ended(&mut events, &again.id).await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn from_one_scanner_to_several_and_what_was_kept_is_there() {
    let rig = Rig::new().await;
    let (old, _) = rig.scan_to_result("old").await;
    assert_eq!(old.scanner, "scanner");
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.scanners.len(), 1);
    assert_eq!(status.scanner.name, "scanner");
    // Its name need not be said, but may.
    let mut events = rig.client.events().await;
    let named: Scan = rig.client.post(path::SCANS, &on("scanner")).await;
    ended(&mut events, &named.id).await;
    let rig = rig.restart_with(left_and_right).await;
    let kept: Scan = rig.client.get(&path::scan(&old.id)).await;
    assert_eq!(kept, old);
    let mut events = rig.client.events().await;
    let new: Scan = rig.client.post(path::SCANS, &on("left")).await;
    ended(&mut events, &new.id).await;
    let list: ScanList = rig.client.get(path::SCANS).await;
    let scanners: Vec<&str> = list.scans.iter().map(|s| s.scanner.as_str()).collect();
    assert_eq!(scanners, ["left", "scanner", "scanner"]);
    // The log of the one that is no more stays as it was: its laser was off.
    let log = logged(rig.folder.path(), "laser.jsonl");
    assert_eq!(log.last().unwrap().laser, LaserState::Off);
    rig.daemon.shutdown().await;
}
