use relief_api::{Event, ScanState};

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::Rig;

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
async fn a_reader_that_does_not_read_holds_up_nobody() {
    let rig = Rig::new().await;
    let mut idle = Vec::new();
    for _ in 0..4 {
        idle.push(rig.client.events().await);
    }
    for name in ["a", "b"] {
        rig.scan_to_result(name).await;
    }
    rig.daemon.shutdown().await;
}
