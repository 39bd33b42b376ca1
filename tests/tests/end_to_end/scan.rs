//! One scan, from the request to the files.

use anyhow::{Context, Result};
use relief_api::{Event, Job, JobState, Scan, ScanState, StartScan, Status, path};
use relief_tests::iges;
use relief_tests::rig::{Rig, journal_columns, small_house};
use serde_json::Value;

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_becomes_a_cad_file_in_the_spool() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let mut events = rig.client().events().await?;
    let request = StartScan {
        name: "gable house".into(),
        part: "H-17/3".into(),
        operator: "A. Measurer".into(),
        note: "second setting".into(),
        ..StartScan::default()
    };
    let scan = rig.scan(&request).await?;
    assert_eq!(
        (scan.name.as_str(), scan.columns_planned),
        ("gable house", 60)
    );
    let published = |event: &Event| match event {
        Event::Published { scan: of, .. } if *of == scan.id => Some(event.clone()),
        _ => None,
    };
    let (seen, last) = events.until(published).await?;

    assert!(
        matches!(seen[0], Event::Status(_)),
        "the status comes first"
    );
    columns_come_live_and_in_order(&seen, &scan.id)?;
    states_follow_each_other(&seen);

    let scan: Scan = rig.client().get(&path::scan(&scan.id)).await?;
    assert_eq!((scan.state, scan.columns), (ScanState::Complete, 60));
    let job: Job = rig.client().get(&path::job(scan.jobs[0])).await?;
    assert_eq!((job.state, job.attempts), (JobState::Done, 1));
    assert_eq!(job.result, scan.id);
    let stages: Vec<&str> = job.timings.iter().map(|t| t.stage.as_str()).collect();
    assert_eq!(
        stages,
        ["segment", "reconstruct", "export", "pictures", "publish"],
        "the range image was made while the table moved"
    );

    let result = rig.result(&scan.id).await?;
    let Event::Published {
        directory, files, ..
    } = last
    else {
        unreachable!("found as such");
    };
    assert_eq!(directory, result.directory);
    assert_eq!(files, result.files.keys().cloned().collect::<Vec<_>>());
    assert_eq!(
        rig.spooled()?,
        [scan.id.as_str()],
        "nothing else is left there"
    );
    manifest_describes_the_files(&result)?;
    the_report_keeps_the_contract(&result, &scan)?;
    assert_eq!(
        iges::entities(result.iges()?, 144)?,
        4,
        "faces of the house"
    );
    assert!(result.file("gable house.igs").is_ok());
    for picture in ["range.png", "regions.png", "residuals.png", "inliers.png"] {
        assert!(
            result.file(picture)?.starts_with(b"\x89PNG\r\n"),
            "{picture}"
        );
    }
    let status: Status = rig.client().get(path::STATUS).await?;
    assert_eq!(
        (status.scan, status.jobs_queued, status.jobs_running),
        (None, 0, 0)
    );
    rig.end().await
}

/// Every column once, in the order of the table, with the grid's columns it finished.
fn columns_come_live_and_in_order(seen: &[Event], id: &str) -> Result<()> {
    let mut expected = 0;
    let mut last_x_mm = f64::NEG_INFINITY;
    let mut live_columns = Vec::new();
    let mut nodes = 0;
    for event in seen {
        let Event::Column {
            scan,
            scanner,
            columns,
            columns_planned,
            samples,
            x_mm,
            pitch_mm,
            live,
        } = event
        else {
            continue;
        };
        expected += 1;
        assert_eq!(
            (scan.as_str(), scanner.as_str(), *columns, *columns_planned),
            (id, "scanner", expected, 60)
        );
        assert!(*x_mm > last_x_mm, "{x_mm} after {last_x_mm}");
        assert!(*samples <= 64 && *pitch_mm > 1.0 && *pitch_mm < 3.0);
        last_x_mm = *x_mm;
        for column in live {
            live_columns.push(column.i);
            let (first, last) = (column.j_first as f64, column.z_um.len() as f64);
            assert!(first * pitch_mm > -60.0 && (first + last) * pitch_mm < 60.0);
            for z_mm in column.z_mm().filter(|z| !z.is_nan()) {
                assert!(z_mm.abs() < 60.0, "{z_mm} mm");
                nodes += 1;
            }
        }
    }
    assert_eq!(expected, 60);
    assert!(
        live_columns.windows(2).all(|pair| pair[0] < pair[1]),
        "{live_columns:?}"
    );
    // Of some 55 columns of the grid, all but the window's came while the table moved.
    assert!(live_columns.len() > 30, "{live_columns:?}");
    assert!(nodes > 1_000, "{nodes} nodes");
    let first_live = seen
        .iter()
        .position(|event| matches!(event, Event::Column { live, .. } if !live.is_empty()));
    let over = seen
        .iter()
        .position(|event| matches!(event, Event::Scan(scan) if scan.state == ScanState::Complete));
    assert!(first_live.context("live columns")? < over.context("the end")?);
    Ok(())
}

fn states_follow_each_other(seen: &[Event]) {
    let scans: Vec<ScanState> = seen
        .iter()
        .filter_map(|event| match event {
            Event::Scan(scan) => Some(scan.state),
            _ => None,
        })
        .collect();
    assert_eq!(
        scans,
        [
            ScanState::Starting,
            ScanState::Scanning,
            ScanState::Complete
        ]
    );
    let jobs: Vec<JobState> = seen
        .iter()
        .filter_map(|event| match event {
            Event::Job(job) => Some(job.state),
            _ => None,
        })
        .collect();
    assert_eq!(jobs, [JobState::Queued, JobState::Running, JobState::Done]);
    let finished: Vec<&str> = seen
        .iter()
        .filter_map(|event| match event {
            Event::Progress {
                stage,
                fraction,
                seconds: Some(seconds),
                ..
            } => {
                assert!(*fraction == 1.0 && *seconds >= 0.0);
                Some(stage.as_str())
            }
            _ => None,
        })
        .collect();
    assert_eq!(
        finished,
        ["segment", "reconstruct", "export", "pictures", "publish"]
    );
}

fn manifest_describes_the_files(result: &relief_tests::rig::Published) -> Result<()> {
    let manifest = result.json("manifest.json")?;
    let mut described = Vec::new();
    for file in manifest["files"].as_array().context("files")? {
        let name = file["name"].as_str().context("name")?;
        assert_eq!(file["bytes"], result.file(name)?.len(), "{name}");
        assert_eq!(file["sha256"], result.sha256(name)?, "{name}");
        described.push(name);
    }
    described.push("manifest.json");
    described.sort_unstable();
    assert_eq!(described, result.files.keys().collect::<Vec<_>>());
    assert_eq!(
        (&manifest["name"], &manifest["seed"]),
        (&"gable house".into(), &1.into())
    );
    assert!(
        manifest["versions"]
            .as_object()
            .is_some_and(|v| !v.is_empty())
    );
    assert!(
        manifest["settings"]
            .as_object()
            .is_some_and(|s| !s.is_empty())
    );
    Ok(())
}

fn the_report_keeps_the_contract(result: &relief_tests::rig::Published, scan: &Scan) -> Result<()> {
    let report = result.json("report.json")?;
    assert_eq!(report["scan"]["id"], scan.id.as_str());
    assert_eq!(report["scan"]["operator"], "A. Measurer");
    assert_eq!(report["scan"]["part"], "H-17/3");
    assert_eq!(report["scan"]["note"], "second setting");
    assert_eq!(report["scan"]["columns"], 60);
    let number = |value: &Value, what: &str| {
        let number = value.as_f64().with_context(|| format!("{what}: {value}"))?;
        assert!(number.is_finite(), "{what}");
        Ok::<_, anyhow::Error>(number)
    };
    assert_eq!(report["regions"]["count"], 4);
    let regions = report["regions"]["list"].as_array().context("regions")?;
    assert_eq!(regions.len(), 4);
    for region in regions {
        assert!(region["kind"].as_str().is_some_and(|kind| !kind.is_empty()));
        assert!(number(&region["nodes"], "nodes")? > 50.0);
        let (rms, max) = (
            number(&region["rms_mm"], "rms")?,
            number(&region["max_mm"], "max")?,
        );
        assert!(0.0 < rms && rms <= max && rms < 0.2, "{rms} {max}");
        assert!(number(&region["psnr_db"], "psnr")? > 30.0);
    }
    assert_eq!(report["model"]["faces"], 4);
    assert!(number(&report["model"]["edges_shared"], "shared")? >= 3.0);
    assert!(number(&report["model"]["free_edges"], "free")? >= 4.0);
    let nodes = number(&report["range_image"]["nodes"], "nodes")?;
    let mut off = 0.0;
    for key in ["lost_nodes", "invented_nodes"] {
        let count = number(&report[key], key)?;
        assert!(
            (0.0..0.05 * nodes).contains(&count),
            "{key}: {count} of {nodes}"
        );
        off += count;
    }
    // Each of these is off by its full value, 7000 to 8000; the others are next to nothing.
    let snr_db = number(&report["snr_db"], "snr")?;
    if off > 0.0 {
        let expected_db = 10.0 * (nodes / off).log10();
        assert!(
            (snr_db - expected_db).abs() < 1.2,
            "{snr_db} dB, not {expected_db}"
        );
    } else {
        // 0.75 mm rms would make 60 dB.
        assert!(snr_db > 60.0, "{snr_db} dB");
    }
    for stage in ["segment", "reconstruct", "export", "pictures"] {
        assert!(number(&report["timings_s"][stage], stage)? >= 0.0);
    }
    assert!(report["warnings"].is_array());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_of_part_of_the_table_is_what_was_asked_for() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let mut request = super::named("strip");
    request.plan.x_first_mm = Some(-20.0);
    request.plan.x_last_mm = Some(20.0);
    request.plan.columns = Some(41);
    request.plan.samples = Some(48);
    let ended = rig.scan_to_result(&request).await?;
    let journal = rig.journal(&ended.scan.id).await?;
    let columns = journal_columns(&journal)?;
    assert_eq!(columns.len(), 41);
    let header = scan_record::JournalReader::open(&journal)?.header().clone();
    for (k, column) in columns.iter().enumerate() {
        let x_mm = header.calibration.x_mm(column.table_counts);
        assert!(
            (x_mm - (k as f64 - 20.0)).abs() < 0.02,
            "column {k} at {x_mm}"
        );
        assert_eq!(column.samples.len() + column.dropouts as usize, 48);
    }
    rig.end().await
}
