//! Several scanners before one service, on pseudo-terminals.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use relief_api::{Aborted, Event, Scan, ScanState, ScannerLink, ScannerSummary, StartScan, path};
use relief_tests::iges;
use relief_tests::rig::{Events, GUARD, Published, Refused, Rig, journal_columns, small_house};
use scan_record::RawColumn;
use sim_scanner::config::SimConfig;

/// Two scanners that see their part with noise of their own.
async fn left_and_right() -> Result<Rig> {
    let of = |seed| SimConfig {
        seed,
        ..small_house()
    };
    Rig::start_several(&[("left", &of(7)), ("right", &of(8))]).await
}

fn on(scanner: &str) -> StartScan {
    StartScan {
        scanner: scanner.into(),
        ..super::named("house")
    }
}

/// Everything that was measured and made of it, apart from ids and times.
#[derive(PartialEq)]
struct Outcome {
    columns: Vec<RawColumn>,
    iges: Vec<u8>,
    pictures: BTreeMap<String, Vec<u8>>,
    report: serde_json::Value,
}

async fn outcome(rig: &Rig, scan: &Scan) -> Result<Outcome> {
    let Published { files, .. } = rig.result(&scan.id).await?;
    let read = |name: &str| files.get(name).with_context(|| format!("no {name}"));
    let mut report: serde_json::Value = serde_json::from_slice(read("report.json")?)?;
    assert_eq!(report["scan"]["scanner"], scan.scanner.as_str());
    for (section, key) in [("", "timestamp"), ("", "timings_s"), ("/scan", "id")] {
        let section = report.pointer_mut(section).context("a section")?;
        let keys = section.as_object_mut().context("an object")?;
        keys.remove(key).with_context(|| format!("no {key}"))?;
    }
    let pictures: BTreeMap<String, Vec<u8>> = files
        .iter()
        .filter(|(name, _)| name.ends_with(".png"))
        .map(|(name, bytes)| (name.clone(), bytes.to_vec()))
        .collect();
    assert_eq!(pictures.len(), 4);
    Ok(Outcome {
        columns: journal_columns(&rig.journal(&scan.id).await?)?,
        iges: iges::without_times(read("house.igs")?)?,
        pictures,
        report,
    })
}

/// What a scan on this scanner comes to while the other one stands still.
async fn alone(scanner: &str) -> Result<Outcome> {
    let rig = left_and_right().await?;
    let ended = rig.scan_to_result(&on(scanner)).await?;
    let outcome = outcome(&rig, &ended.scan).await?;
    rig.end().await?;
    Ok(outcome)
}

/// Both scanners in the midst of a scan, with so many columns on disk.
async fn amid(columns: u32) -> Result<(Rig, Events, Scan, Scan)> {
    let rig = left_and_right().await?;
    let mut events = rig.client().events().await?;
    for name in ["left", "right"] {
        rig.control_of(name)?.step_columns(Some(columns));
    }
    let left = rig.scan(&on("left")).await?;
    let right = rig.scan(&on("right")).await?;
    let mut waiting = vec![left.id.clone(), right.id.clone()];
    let there = |event: &Event| {
        if let Event::Column {
            scan, columns: n, ..
        } = event
            && *n == columns
        {
            waiting.retain(|id| id != scan);
        }
        waiting.is_empty().then_some(())
    };
    events.until(there).await?;
    Ok((rig, events, left, right))
}

async fn paused(events: &mut Events, id: &str) -> Result<Scan> {
    let there = |event: &Event| match event {
        Event::Scan(scan) if scan.id == id && scan.state == ScanState::Paused => Some(scan.clone()),
        _ => None,
    };
    Ok(events.until(there).await?.1)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scanner_that_is_pulled_in_mid_scan_leaves_the_other_scan_as_if_alone() -> Result<()> {
    let (undisturbed_left, undisturbed_right) = (alone("left").await?, alone("right").await?);
    let (rig, mut events, left, right) = amid(20).await?;
    let pulled = rig.control_of("left")?;
    pulled.unplug();
    paused(&mut events, &left.id).await?;
    rig.control_of("right")?.step_columns(None);
    let right_over = events.scan_complete(&right.id).await?;
    let summary: ScannerSummary = rig.client().get(&path::scanner("left")).await?;
    assert_eq!(summary.status.link, ScannerLink::Trouble);
    assert_eq!(summary.scan.context("a scan")?.columns, 20);

    // And the pulled one goes on where it was, once it is back: at once, before jobs that take their time,
    // since the driver asks for a person once it has tried for a minute or so.
    pulled.step_columns(None);
    pulled.replug();
    let left_over = events.scan_complete(&left.id).await?;
    rig.first_job(&right_over, &mut events).await?;
    let disturbed = outcome(&rig, &right_over).await?;
    assert!(disturbed == undisturbed_right);
    rig.first_job(&left_over, &mut events).await?;
    let resumed = outcome(&rig, &left_over).await?;
    assert!(resumed == undisturbed_left);
    assert!(
        resumed.columns != disturbed.columns,
        "the scanners are not the same"
    );
    let mut results = vec![left.id, right.id];
    results.sort();
    assert_eq!(rig.spooled()?, results);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn of_several_paused_scans_none_goes_on_unless_it_is_named() -> Result<()> {
    let (rig, mut events, left, right) = amid(20).await?;
    for (name, scan) in [("left", &left), ("right", &right)] {
        rig.control_of(name)?.set_interlock(true);
        paused(&mut events, &scan.id).await?;
    }
    let unnamed = rig.client().ask::<Scan>(path::RESUME).await;
    let refused = unnamed.expect_err("which one?").downcast::<Refused>()?.0;
    assert_eq!((refused.status, refused.kind.as_str()), (409, "which-scan"));
    assert_eq!(
        refused.detail,
        format!(
            "several scans are paused: {} on left, {} on right",
            left.id, right.id
        )
    );
    for name in ["left", "right"] {
        let control = rig.control_of(name)?;
        control.set_interlock(false);
        control.step_columns(None);
        assert!(!control.snapshot().laser_on);
    }
    let resumed: Scan = rig.client().ask(&path::scanner_resume("right")).await?;
    assert_eq!(resumed.id, right.id);
    events.scan_complete(&right.id).await?;
    assert!(!rig.control_of("left")?.snapshot().laser_on);
    // Now there is but one.
    let resumed: Scan = rig.client().ask(path::RESUME).await?;
    assert_eq!(resumed.id, left.id);
    events.scan_complete(&left.id).await?;
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn an_abort_without_a_name_turns_off_every_laser() -> Result<()> {
    let (rig, mut events, left, right) = amid(20).await?;
    let aborted: Aborted = rig.client().ask(path::ABORT).await?;
    assert_eq!(
        (&aborted.scan.id, &aborted.others[0].id),
        (&left.id, &right.id)
    );
    for name in ["left", "right"] {
        let control = rig.control_of(name)?;
        control.wait_until(GUARD, |device| !device.laser_on)?;
    }
    let mut waiting = vec![left.id.clone(), right.id.clone()];
    let over = |event: &Event| {
        if let Event::Scan(scan) = event
            && scan.state.is_over()
        {
            assert_eq!((scan.state, scan.columns), (ScanState::Aborted, 20));
            waiting.retain(|id| *id != scan.id);
        }
        waiting.is_empty().then_some(())
    };
    events.until(over).await?;
    rig.end().await
}
