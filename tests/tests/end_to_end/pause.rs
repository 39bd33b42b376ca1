//! A scan that pauses, and goes on by itself or on a word.

use anyhow::Result;
use relief_api::{Event, LaserState, Scan, ScanState, ScannerLink, Status, path};
use relief_tests::rig::{
    Events, GUARD, Refused, Rig, journal_columns, leisurely_house, small_house,
};
use scanner_protocol::{Faults, ResetCause};
use sim_scanner::config::SimConfig;

/// Waits until the scan is paused for a reason with these words in it.
async fn paused(events: &mut Events, id: &str, words: &str) -> Result<Scan> {
    let there = |event: &Event| match event {
        Event::Scan(scan) if scan.id == id && scan.state == ScanState::Paused => {
            let reason = scan.reason.clone().unwrap_or_default();
            reason.contains(words).then(|| scan.clone())
        }
        _ => None,
    };
    Ok(events.until(there).await?.1)
}

/// A service in the middle of a scan, with this many columns on disk.
async fn amid(columns: u32) -> Result<(Rig, Events, Scan)> {
    let rig = Rig::start(&small_house()).await?;
    rig.control()?.step_columns(Some(columns));
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("house")).await?;
    events.columns(&scan.id, columns).await?;
    Ok((rig, events, scan))
}

/// What an undisturbed scan keeps.
async fn undisturbed(scanner: &SimConfig) -> Result<Vec<scan_record::RawColumn>> {
    let rig = Rig::start(scanner).await?;
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("house")).await?;
    events.scan_complete(&scan.id).await?;
    let columns = journal_columns(&rig.journal(&scan.id).await?)?;
    rig.end().await?;
    Ok(columns)
}

#[tokio::test(flavor = "multi_thread")]
async fn an_open_interlock_pauses_the_scan_until_a_person_has_looked() -> Result<()> {
    let (rig, mut events, scan) = amid(20).await?;
    let control = rig.control()?;
    control.set_interlock(true);
    let stopped = paused(&mut events, &scan.id, "relief resume").await?;
    let reason = stopped.reason.unwrap_or_default();
    assert!(reason.contains("interlock open"), "{reason}");
    assert_eq!(stopped.columns, 20, "what was measured is on disk");
    assert!(!control.snapshot().laser_on);
    let status: Status = rig.client().get(path::STATUS).await?;
    assert_eq!(status.scanner.link, ScannerLink::Trouble);
    assert_eq!(status.scan.map(|scan| scan.state), Some(ScanState::Paused));

    // Nothing goes on while the door is open, whoever asks.
    let _: Scan = rig.client().ask(path::RESUME).await?;
    paused(&mut events, &scan.id, "by itself").await?;
    paused(&mut events, &scan.id, "relief resume").await?;
    assert!(!control.snapshot().laser_on);

    control.set_interlock(false);
    control.step_columns(None);
    let _: Scan = rig.client().ask(&path::scan_resume(&scan.id)).await?;
    let over = events.scan_complete(&scan.id).await?;
    assert_eq!((over.columns, over.reason), (60, None));
    let columns = journal_columns(&rig.journal(&scan.id).await?)?;
    assert_eq!(columns, undisturbed(&small_house()).await?);

    let again = rig.client().ask::<Scan>(path::RESUME).await;
    let refused = again.expect_err("it is over").downcast::<Refused>()?.0;
    assert_eq!(
        (refused.status, refused.kind.as_str()),
        (409, "nothing-to-resume")
    );
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reset_of_the_device_is_got_over_by_itself() -> Result<()> {
    let (rig, mut events, scan) = amid(20).await?;
    let control = rig.control()?;
    control.reset(ResetCause::Watchdog, b"boot: ");
    control.step_columns(None);
    paused(&mut events, &scan.id, "restarted").await?;
    let over = events.scan_complete(&scan.id).await?;
    assert_eq!(over.columns, 60);
    let columns = journal_columns(&rig.journal(&scan.id).await?)?;
    assert_eq!(columns, undisturbed(&small_house()).await?);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_moved_object_is_refused_with_its_figure_until_it_is_put_back() -> Result<()> {
    let (rig, mut events, scan) = amid(30).await?;
    let control = rig.control()?;
    let moved = sim_scanner::Vec3::new(0.0, 0.0, 1.5);
    control.move_part(moved);
    control.raise_faults(Faults::TABLE_STALL);
    control.mend(Faults::TABLE_STALL);
    control.step_columns(None);
    let refused = paused(&mut events, &scan.id, "has moved").await?;
    let reason = refused.reason.unwrap_or_default();
    assert!(reason.contains("mm off"), "{reason}");
    assert_eq!(refused.columns, 30);
    // It is told before the scanner is.
    control.wait_until(GUARD, |device| !device.laser_on)?;
    control.move_part(-moved);
    let _: Scan = rig.client().ask(path::RESUME).await?;
    events.scan_complete(&scan.id).await?;
    let columns = journal_columns(&rig.journal(&scan.id).await?)?;
    assert_eq!(columns, undisturbed(&small_house()).await?);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_paused_scan_can_be_aborted() -> Result<()> {
    let (rig, mut events, scan) = amid(20).await?;
    rig.control()?.set_interlock(true);
    paused(&mut events, &scan.id, "interlock open").await?;
    let _: Scan = rig.client().ask(path::ABORT).await?;
    let over = events.scan_over(&scan.id).await?;
    assert_eq!((over.state, over.columns), (ScanState::Aborted, 20));
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_paused_on_request_stands_still_with_the_laser_off() -> Result<()> {
    // A scanner that waits for the test would have its laser off by itself.
    let leisurely = leisurely_house();
    let rig = Rig::start(&leisurely).await?;
    let control = rig.control()?;
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("house")).await?;
    events.columns(&scan.id, 20).await?;
    control.wait_until(GUARD, |device| device.laser_on)?;
    let _: Scan = rig.client().ask(path::PAUSE).await?;
    // By the simulator's truth, as soon as this is answered.
    assert!(!control.snapshot().laser_on);
    let stopped = paused(&mut events, &scan.id, "paused on request").await?;
    assert!(stopped.needs_person);
    assert!((20..2_000).contains(&stopped.columns), "{stopped:?}");
    let status: Status = rig.client().get(path::STATUS).await?;
    assert_eq!(status.scanner.link, ScannerLink::Scanning, "no trouble");
    assert_eq!(status.laser.map(|entry| entry.laser), Some(LaserState::Off));

    // Once more changes nothing, and no column comes.
    let _: Scan = rig.client().ask(&path::scan_pause(&scan.id)).await?;
    assert!(!control.snapshot().laser_on);
    let still: Scan = rig.client().get(&path::scan(&scan.id)).await?;
    assert_eq!(
        (still.state, still.columns),
        (ScanState::Paused, stopped.columns)
    );

    let _: Scan = rig.client().ask(path::RESUME).await?;
    let over = events.scan_complete(&scan.id).await?;
    assert_eq!((over.columns, over.reason), (2_000, None));
    let columns = journal_columns(&rig.journal(&scan.id).await?)?;
    // How fast it measures is not seen in what it measures.
    let mut hurried = leisurely;
    hurried.device.line_rate_hz = small_house().device.line_rate_hz;
    assert!(columns == undisturbed(&hurried).await?);

    let again = rig.client().ask::<Scan>(path::PAUSE).await;
    let refused = again.expect_err("it is over").downcast::<Refused>()?.0;
    assert_eq!(
        (refused.status, refused.kind.as_str()),
        (409, "nothing-to-pause")
    );
    rig.end().await
}
