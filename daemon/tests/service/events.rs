use relief_api::{Event, LaserState, PlanRequest, Scan, ScanState, StartScan, path};
use scanner_driver::{Pause, ScannerError};
use scanner_protocol::Faults;

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::{Rig, ended};

#[tokio::test(flavor = "multi_thread")]
async fn the_stream_tells_the_whole_story_in_order() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let Some(Event::Status(status)) = events.next().await else {
        panic!("the status comes first");
    };
    assert_eq!(status.version, env!("CARGO_PKG_VERSION"));
    let scan = rig.start_scan("live").await;
    let published = |event: &Event| match event {
        Event::Published { result, files, .. } => Some((result.clone(), files.clone())),
        _ => None,
    };
    let (story, (result, files)) = events.until(published).await;
    assert_eq!(result, scan.id);
    assert!(files.contains(&"live.igs".to_owned()), "{files:?}");

    let states: Vec<ScanState> = story
        .iter()
        .filter_map(|event| match event {
            Event::Scan(scan) => Some(scan.state),
            _ => None,
        })
        .collect();
    assert_eq!(
        states,
        [
            ScanState::Starting,
            ScanState::Scanning,
            ScanState::Complete
        ]
    );

    let lasers: Vec<(LaserState, &str)> = story
        .iter()
        .filter_map(|event| match event {
            Event::Laser(entry) => Some((entry.laser, entry.cause.as_str())),
            _ => None,
        })
        // That it was off may be told just before, as the scanner is met.
        .skip_while(|entry| *entry == (LaserState::Off, "the scanner says that it is off"))
        .collect();
    let off = (LaserState::Off, "the scan is complete");
    assert_eq!(lasers, [(LaserState::On, "a scan begins"), off]);
    let first = story.iter().find(|event| {
        let is_on = |event: &Event| matches!(event, Event::Laser(e) if e.laser == LaserState::On);
        is_on(event) || matches!(event, Event::Column { .. })
    });
    assert!(
        matches!(first, Some(Event::Laser(_))),
        "on before the first column"
    );

    let mut counts = Vec::new();
    let mut nodes = 0;
    for event in &story {
        if let Event::Column {
            columns,
            samples,
            pitch_mm,
            live,
            ..
        } = event
        {
            counts.push(*columns);
            assert_eq!((*samples, *pitch_mm), (u32::from(SAMPLES), 0.5));
            for column in live {
                for (z_mm, j) in column.z_mm().zip(column.j_first..) {
                    if z_mm.is_nan() {
                        continue;
                    }
                    nodes += 1;
                    // On the roof, except where a node's window has the ridge in it.
                    let y_mm = j as f64 * 0.5;
                    if y_mm.abs() > 4.0 {
                        let roof_mm = 10.0 - y_mm.abs() / 2.0;
                        assert!((z_mm - roof_mm).abs() < 2e-3, "{z_mm} at y = {y_mm}");
                    }
                }
            }
        }
    }
    assert_eq!(counts, (1..=COLUMNS).collect::<Vec<_>>());
    assert!(nodes > 1_000, "{nodes} live nodes");

    let finished: Vec<&str> = story
        .iter()
        .filter_map(|event| match event {
            Event::Progress {
                stage,
                seconds: Some(_),
                ..
            } => Some(stage.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(
        finished,
        ["segment", "reconstruct", "export", "pictures", "publish"],
        "the regridding was done while the scanner moved"
    );
    rig.daemon.shutdown().await;
    while events.next().await.is_some() {}
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_is_told_behind_the_columns_before_it() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let pause = Pause {
        cause: ScannerError::Fault(Faults::INTERLOCK),
        needs_person: true,
        columns: COLUMNS - 1,
    };
    // All at once, so that the range image is behind with them.
    rig.scanner.pause_after(pause.columns, pause.clone());
    let scan = rig.start_scan("paused").await;
    let paused = |event: &Event| match event {
        Event::Scan(scan) if scan.state == ScanState::Paused => Some(()),
        _ => None,
    };
    let (story, ()) = events.until(paused).await;
    let columns = |event: &&Event| matches!(event, Event::Column { .. });
    assert_eq!(story.iter().filter(columns).count(), pause.columns as usize);
    let _: Scan = rig.client.ask(&path::scan_resume(&scan.id)).await;
    ended(&mut events, &scan.id).await;
    rig.daemon.shutdown().await;
}

/// Scans whose words are more than the service keeps for readers that are behind (8 MiB) and all
/// buffers of a socket together: each is told of three times at least, with its note.
const WORDY_SCANS: usize = 16;
const NOTE_BYTES: usize = 250_000;

#[tokio::test(flavor = "multi_thread")]
async fn a_reader_that_does_not_read_holds_up_nobody() {
    // Longer than the scans take on a slow disk, so that no idle reader is cut off.
    let patient = |config: &mut reliefd::Config| config.http.stall_timeout_ms = 600_000;
    let rig = Rig::start(tempfile::tempdir().unwrap(), patient).await;
    let mut idle = Vec::new();
    for _ in 0..4 {
        idle.push(rig.client.events().await);
    }
    let mut reading = rig.client.events().await;
    for number in 0..WORDY_SCANS {
        let request = StartScan {
            name: format!("wordy-{number}"),
            note: "n".repeat(NOTE_BYTES),
            plan: PlanRequest {
                columns: Some(2),
                ..PlanRequest::default()
            },
            ..StartScan::default()
        };
        let scan: Scan = rig.client.post(path::SCANS, &request).await;
        let scan = ended(&mut reading, &scan.id).await;
        assert_eq!(scan.state, ScanState::Complete, "{:?}", scan.reason);
    }
    let (last, _) = rig.scan_to_result("last").await;
    for events in &mut idle {
        let lost = |event: &Event| match event {
            Event::Lagged { missed } => Some(*missed),
            Event::Published { scan, .. } if *scan == last.id => Some(0),
            _ => None,
        };
        // It is told that it has lost something, and then hears the rest.
        let (before, missed) = events.until(lost).await;
        assert!(missed > 0, "it heard all of {} events", before.len());
        let published = |event: &Event| match event {
            Event::Published { scan, .. } if *scan == last.id => Some(()),
            _ => None,
        };
        events.until(published).await;
    }
    rig.daemon.shutdown().await;
}
