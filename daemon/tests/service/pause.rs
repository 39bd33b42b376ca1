//! A scan that somebody pauses.

use std::sync::mpsc::channel;

use relief_api::{Event, LaserState, Problem, Scan, ScanState, ScannerLink, Status, path};
use reliefd::Config;
use reliefd::config::ScannerConfig;

use crate::client::Events;
use crate::fake::COLUMNS;
use crate::rig::{Rig, ended};

/// A scan with this many columns on disk.
async fn amid(change: impl FnOnce(&mut Config), columns: u32) -> (Rig, Events, Scan) {
    let rig = Rig::start(tempfile::tempdir().unwrap(), change).await;
    let mut events = rig.client.events().await;
    rig.scanner.allow(columns);
    let scan = rig.start_scan("house").await;
    until_columns(&mut events, &scan.id, columns).await;
    (rig, events, scan)
}

async fn until_columns(events: &mut Events, id: &str, wanted: u32) {
    let there = |event: &Event| match event {
        Event::Column { scan, columns, .. } => (scan == id && *columns == wanted).then_some(()),
        _ => None,
    };
    events.until(there).await;
}

async fn paused(events: &mut Events, id: &str) -> Scan {
    let there = |event: &Event| match event {
        Event::Scan(scan) if scan.id == id && scan.state == ScanState::Paused => Some(scan.clone()),
        _ => None,
    };
    events.until(there).await.1
}

async fn refused(rig: &Rig, path: &str) -> Problem {
    rig.client.request("POST", path, None).await.problem()
}

#[track_caller]
fn assert_is(problem: &Problem, status: u16, kind: &str, words: &str) {
    assert_eq!((problem.status, problem.kind.as_str()), (status, kind));
    assert!(problem.detail.contains(words), "{}", problem.detail);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_turns_the_laser_off_until_somebody_lets_the_scan_go_on() {
    let (rig, mut events, scan) = amid(|_| {}, 20).await;
    let asked: Scan = rig.client.ask(&path::scan_pause(&scan.id)).await;
    assert_eq!(asked.id, scan.id);
    assert!(!rig.scanner.laser_is_on());
    let presence = format!("state/scans/{}.presence", scan.id);
    let presence = rig.folder.path().join(presence);
    assert!(!presence.exists(), "no other start goes on by itself");
    let still = paused(&mut events, &scan.id).await;
    assert_eq!((still.columns, still.needs_person), (20, true));
    let reason = "paused on request; `relief resume` lets it go on";
    assert_eq!(still.reason.as_deref(), Some(reason));
    let status: Status = rig.client.get(path::STATUS).await;
    // It is no trouble.
    assert_eq!(status.scanner.link, ScannerLink::Scanning);
    assert_eq!(status.scanner.problem, None);
    let laser = status.laser.unwrap();
    assert_eq!(laser.laser, LaserState::Off, "{laser:?}");
    assert_eq!(laser.scan, Some(scan.id.clone()));

    // Once more, nothing changes.
    let again: Scan = rig.client.ask(path::PAUSE).await;
    assert_eq!((again.state, again.columns), (ScanState::Paused, 20));

    rig.scanner.allow_all();
    let _: Scan = rig.client.ask(path::RESUME).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));

    let none = refused(&rig, path::PAUSE).await;
    assert_is(&none, 409, "nothing-to-pause", "no scan is running");
    let over = refused(&rig, &path::scan_pause(&scan.id)).await;
    assert_is(&over, 409, "nothing-to-pause", &scan.id);
    let idle = refused(&rig, &path::scanner_pause("scanner")).await;
    assert_is(&idle, 409, "nothing-to-pause", "no scan is running");
    let unknown = refused(&rig, &path::scan_pause("x")).await;
    assert_is(&unknown, 404, "no-such-scan", "x");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_that_could_not_go_on_is_not_paused() {
    let (rig, mut events, scan) = amid(|config| config.scanner.resume = false, 20).await;
    let refused = refused(&rig, path::PAUSE).await;
    assert_is(&refused, 409, "cannot-pause", "[scanner] resume is false");
    rig.scanner.allow_all();
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_before_the_scan_has_begun_is_refused() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let (begins, begun) = channel();
    let (refused_it, go) = channel();
    rig.scanner.on_start(move || {
        begins.send(()).unwrap();
        go.recv().unwrap();
    });
    let scan = rig.start_scan("house").await;
    tokio::task::spawn_blocking(move || begun.recv().unwrap())
        .await
        .unwrap();
    let refused = refused(&rig, &path::scan_pause(&scan.id)).await;
    assert_is(&refused, 409, "cannot-pause", "not begun yet");
    refused_it.send(()).unwrap();
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_several_running_scans_the_one_is_paused_that_is_named() {
    let left_and_right = |config: &mut Config| {
        for name in ["left", "right"] {
            let scanner = ScannerConfig {
                port: format!("/dev/{name}").into(),
                ..ScannerConfig::default()
            };
            config.scanners.insert(name.into(), scanner);
        }
    };
    let rig = Rig::start(tempfile::tempdir().unwrap(), left_and_right).await;
    let mut events = rig.client.events().await;
    let mut scans = Vec::new();
    for name in ["left", "right"] {
        rig.of(name).allow(10);
        let wishes = serde_json::json!({ "scanner": name });
        let scan: Scan = rig.client.post(path::SCANS, &wishes).await;
        until_columns(&mut events, &scan.id, 10).await;
        scans.push(scan);
    }
    let unnamed = refused(&rig, path::PAUSE).await;
    assert_is(&unnamed, 409, "which-scan", "several scans are running");
    assert!(rig.of("left").laser_is_on() && rig.of("right").laser_is_on());
    let right: Scan = rig.client.ask(&path::scanner_pause("right")).await;
    assert_eq!(right.id, scans[1].id);
    assert!(!rig.of("right").laser_is_on());
    paused(&mut events, &right.id).await;
    assert!(rig.of("left").laser_is_on());
    // Now there is but one that does not wait already.
    let left: Scan = rig.client.ask(path::PAUSE).await;
    assert_eq!(left.id, scans[0].id);
    paused(&mut events, &left.id).await;
    for (name, scan) in ["left", "right"].into_iter().zip(&scans) {
        rig.of(name).allow_all();
        let _: Scan = rig.client.ask(&path::scan_resume(&scan.id)).await;
        let over = ended(&mut events, &scan.id).await;
        assert_eq!(over.state, ScanState::Complete);
    }
    rig.daemon.shutdown().await;
}
