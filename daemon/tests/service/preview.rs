//! What a scan would be is what it then is, and nothing moves before.

use relief_api::{Event, PlanRequest, Scan, ScanList, ScanPreview, StartScan, path};

use crate::fake::{COLUMNS, SAMPLES};
use crate::rig::{Rig, ended};

fn asked(columns: u32) -> StartScan {
    StartScan {
        name: "roof".into(),
        plan: PlanRequest {
            columns: Some(columns),
            pitch_mm: Some(0.25),
            ..PlanRequest::default()
        },
        ..StartScan::default()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_preview_is_what_the_scan_then_is() {
    let rig = Rig::new().await;
    let request = asked(40);
    let preview: ScanPreview = rig.client.post(path::SCAN_PREVIEW, &request).await;
    let scans: ScanList = rig.client.get(path::SCANS).await;
    assert!(scans.scans.is_empty(), "{scans:?}");
    assert!(!rig.scanner.laser_is_on());
    assert_eq!(preview.refused, None);
    assert_eq!((preview.columns, preview.samples), (40, SAMPLES));
    assert_eq!((preview.x_mm, preview.column_pitch_mm), ([0.0, 9.75], 0.25));
    assert_eq!(preview.y_mm, Some([-15.0, 14.5]));
    assert_eq!(preview.sample_spacing_mm, Some(0.5));
    // The area of 49 samples of 0.25 mm by 0.5 mm, as a circle.
    let window_mm = preview.window_mm.unwrap();
    assert!((window_mm - 2.793).abs() < 1e-3, "{window_mm}");
    assert_eq!(preview.least_s, None, "it names no line rate");
    assert_eq!(preview.notes, [""; 0]);

    let mut events = rig.client.events().await;
    let scan: Scan = rig.client.post(path::SCANS, &request).await;
    let pitch = |event: &Event| match event {
        Event::Column {
            pitch_mm,
            columns_planned,
            ..
        } => Some((*pitch_mm, *columns_planned)),
        _ => None,
    };
    let (_, (pitch_mm, columns_planned)) = events.until(pitch).await;
    assert_eq!(columns_planned, preview.columns);
    assert_eq!(preview.settings["regrid.pitch_mm"], pitch_mm);
    let over = ended(&mut events, &scan.id).await;
    assert_eq!(over.columns, preview.columns);
    let bytes = std::fs::metadata(rig.journal(&scan.id)).unwrap().len();
    assert!(bytes > 0 && bytes <= preview.journal_bytes, "{bytes}");
    let [across, up] = preview.grid_nodes.unwrap();
    let per_side = |mm: f64| (mm / pitch_mm) as u64 + 1;
    assert_eq!((across, up), (per_side(9.75), per_side(29.5)));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_preview_says_what_stands_in_the_way_and_what_may_surprise() {
    let rig = Rig::new().await;
    rig.scanner.allow(3);
    let scan = rig.start_scan("first").await;
    let mut request = asked(COLUMNS);
    let set = |request: &mut StartScan, key: &str, value: f64| {
        request.settings.insert(key.into(), value.into());
    };
    set(&mut request, "regrid.pitch_mm", 0.1);
    let preview: ScanPreview = rig.client.post(path::SCAN_PREVIEW, &request).await;
    let refused = preview.refused.unwrap();
    assert!(refused.contains(&scan.id), "{refused}");
    let [note] = preview.notes.try_into().unwrap();
    assert!(note.contains("finer than the samples"), "{note}");
    assert_eq!(preview.settings["regrid.pitch_mm"], 0.1);
    set(&mut request, "regrid.pitch_mm", 3.0);
    let preview: ScanPreview = rig.client.post(path::SCAN_PREVIEW, &request).await;
    assert!(preview.notes[0].contains("coarser"), "{:?}", preview.notes);
    request.settings.clear();
    request
        .settings
        .insert("regrid.neighbours".into(), 6.into());
    let preview: ScanPreview = rig.client.post(path::SCAN_PREVIEW, &request).await;
    assert!(preview.notes[0].contains("hardly"), "{:?}", preview.notes);

    // What the scanner cannot do is refused as the scan would be.
    let body = serde_json::to_string(&asked(1_000_000)).unwrap();
    let reply = rig.client.request("POST", path::SCAN_PREVIEW, Some(&body));
    let reply = reply.await;
    assert_eq!(reply.status, 400);
    rig.scanner.allow_all();
    rig.daemon.shutdown().await;
}
