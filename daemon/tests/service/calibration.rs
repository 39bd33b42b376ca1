//! A scanner that is known to deviate: what a scan keeps of that, and when it is refused.

use relief_api::{Status, path};
use reliefd::Config;
use reliefd::calibration::{Announced, CalibrationFile, Deviations, InForce};
use scan_record::JournalReader;

use crate::rig::{Rig, json};

/// For the scanner in memory.
fn in_force(date: &str) -> Box<InForce> {
    Box::new(InForce {
        file: CalibrationFile {
            scanner_model: "Fake".into(),
            scanner_serial: "F-1".into(),
            date: date.into(),
            method: "by hand".into(),
            reference: "none".into(),
            scans: Vec::new(),
            program: "a test".into(),
            samples: 1,
            residual_before_mm: 0.06,
            residual_after_mm: 0.05,
            undetermined: vec!["camera x".into()],
            announced: Announced {
                table_origin_mm: 0.0,
                table_count_mm: 0.001,
                camera_y_mm: None,
                camera_z_mm: None,
                angle_count_rad: None,
                range_count_mm: None,
                count_mm: Some(0.001),
            },
            correction: Deviations {
                angle_scale: 0.01,
                table_scale: 0.02,
                camera_z_mm: 5.0,
                ..Deviations::default()
            },
            uncertainty: Deviations::default(),
        },
        calibration_days: 100,
    })
}

async fn rig(date: &str, change: impl FnOnce(&mut InForce)) -> Rig {
    let mut own = in_force(date);
    change(&mut own);
    let set = |config: &mut Config| config.scanner.in_force = Some(own);
    Rig::start(tempfile::tempdir().unwrap(), set).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_is_corrected_and_says_by_what() {
    let rig = rig("2020-01-01T00:00:00Z", |_| {}).await;
    let (scan, job) = rig.scan_to_result("roof").await;
    let mut journal = JournalReader::open(&rig.journal(&scan.id)).unwrap();
    let calibration = journal.header().calibration;
    let kept = InForce::kept_with(journal.header()).unwrap();
    assert_eq!(kept, *in_force("2020-01-01T00:00:00Z"));
    assert_eq!(calibration.correction, Some(kept.file.correction()));
    // Counts stay, millimetres do not.
    let raw = journal.next_column().unwrap().unwrap();
    let (with, without) = (
        raw.calibrated(&calibration),
        raw.calibrated(&calibration.as_announced()),
    );
    let (a, b) = (with.samples()[0], without.samples()[0]);
    assert!((a.y_mm - 1.01 * b.y_mm).abs() < 1e-12 && (a.z_mm - b.z_mm - 5.0).abs() < 1e-12);

    let result = rig.folder.path().join("spool").join(&job.result);
    let report = json(&result.join("report.json"));
    let told = &report["scan"]["calibration"];
    assert_eq!(told["date"], "2020-01-01T00:00:00Z");
    assert_eq!(told["residual_mm"], 0.05);
    assert!(told["age_days"].as_i64().unwrap() > 2000, "{told}");
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("more than the 100 of"), "{warnings}");
    // The ridge of the roof runs where the correction puts it.
    let image = &report["range_image"];
    assert!(image["nodes"].as_u64().unwrap() > 0, "{image}");

    let status: Status = rig.client.get(path::STATUS).await;
    let told = status.scanner.calibration.unwrap();
    assert!(told.overdue && told.age_days > 2000, "{told:?}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_is_refused_rather_than_corrected_wrongly() {
    let other = |own: &mut InForce| own.file.scanner_serial = "F-2".into();
    let announced = |own: &mut InForce| own.file.announced.count_mm = Some(0.002);
    let date = "2020-01-01T00:00:00Z";
    for (rig, words) in [
        (rig(date, other).await, "is for Fake, serial number F-2"),
        (rig(date, announced).await, "announces other counts"),
    ] {
        let body = Some(r#"{"name": "roof"}"#);
        let problem = rig
            .client
            .request("POST", path::SCANS, body)
            .await
            .problem();
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (409, "other-calibration")
        );
        let told = &problem.detail;
        assert!(told.contains(words) && told.contains("[scanner]"), "{told}");
        assert!(!rig.scanner.laser_is_on());
        rig.daemon.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rerun_is_corrected_as_the_scan_was() {
    let rig = rig("2020-01-01T00:00:00Z", |_| {}).await;
    let (scan, job) = rig.scan_to_result("roof").await;
    let iges = |rig: &Rig, result: &str| {
        let folder = rig.folder.path().join("spool").join(result);
        std::fs::read(folder.join("roof.igs")).unwrap()
    };
    let first = iges(&rig, &job.result);
    // The calibration goes out of force, and the scan is processed once more.
    let rig = rig.restart_with(|_| {}).await;
    let mut events = rig.client.events().await;
    let body = serde_json::json!({ "name": "roof" });
    let again: relief_api::Job = rig.client.post(&path::scan_rerun(&scan.id), &body).await;
    let again = crate::rig::job_over(&mut events, &rig, again.id).await;
    assert_eq!(iges(&rig, &again.result), first);
    rig.daemon.shutdown().await;
}
