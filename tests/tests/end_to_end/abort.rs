//! A scan that is ended in the middle.

use anyhow::Result;
use relief_api::{Job, JobList, Scan, ScanState, StartScan, path};
use relief_tests::rig::{GUARD, Refused, Rig, journal_columns, leisurely_house, small_house};
use scan_record::{EndCause, Ending, JournalReader};
use sim_scanner::device::Event as Happened;

/// A scan that takes no more than the rest of the test.
fn short(name: &str) -> StartScan {
    let mut request = super::named(name);
    request.plan.columns = Some(60);
    request
}

#[tokio::test(flavor = "multi_thread")]
async fn an_aborted_scan_is_kept_and_the_next_one_works() -> Result<()> {
    let rig = Rig::start(&leisurely_house()).await?;
    let control = rig.control()?;
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("cut short")).await?;
    events.columns(&scan.id, 24).await?;
    control.wait_until(GUARD, |device| device.laser_on)?;

    let replied: Scan = rig.client().ask(&path::scan_abort(&scan.id)).await?;
    // Off already when the service says so, whoever looks.
    assert!(!control.snapshot().laser_on);
    assert_eq!(replied.id, scan.id);
    assert!(control.events().contains(&Happened::Aborted));
    let over = events.scan_over(&scan.id).await?;
    assert_eq!(over.state, ScanState::Aborted);
    assert_eq!(over.reason.as_deref(), Some("aborted on request"));
    assert!(
        (24..2_000).contains(&over.columns),
        "{} columns",
        over.columns
    );
    assert_eq!(over.jobs.len(), 0);

    let journal = rig.journal(&scan.id).await?;
    assert_eq!(journal_columns(&journal)?.len(), over.columns as usize);
    let mut reader = JournalReader::open(&journal)?;
    while reader.next_column()?.is_some() {}
    let cause = EndCause::Aborted("aborted on request".into());
    assert_eq!(reader.ending(), Some(&Ending::Closed(cause)));
    assert_eq!(rig.client().get::<JobList>(path::JOBS).await?.jobs, []);
    assert!(rig.spooled()?.is_empty());
    let again = rig.client().ask::<Scan>(&path::scan_abort(&scan.id)).await;
    let refused = again.expect_err("it is over").downcast::<Refused>()?.0;
    assert_eq!(
        (refused.status, refused.kind.as_str()),
        (409, "scan-is-over")
    );
    assert!(!control.snapshot().laser_on, "and it stays off");

    let next = rig.scan_to_result(&short("whole")).await?;
    assert_eq!(next.scan.columns, 60);
    assert_eq!(rig.spooled()?, [next.scan.id.as_str()]);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn what_an_aborted_scan_kept_can_be_processed() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    rig.control()?.step_columns(Some(40));
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("most of it")).await?;
    events.columns(&scan.id, 40).await?;
    let _: Scan = rig.client().ask(path::ABORT).await?;
    events.scan_over(&scan.id).await?;
    let job: Job = rig.rerun_to_result(&scan.id, &[]).await?;
    let report = rig.result(&job.result).await?.json("report.json")?;
    assert_eq!(report["scan"]["columns"], 40);
    let warned = report["warnings"].to_string();
    assert!(warned.contains("aborted on request"), "{warned}");
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn an_end_of_the_service_turns_the_laser_off() -> Result<()> {
    let rig = Rig::start(&leisurely_house()).await?;
    let control = rig.control()?;
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("interrupted")).await?;
    events.columns(&scan.id, 10).await?;
    control.wait_until(GUARD, |device| device.laser_on)?;
    let rig = rig.restart(|_| {}).await?;
    assert!(!control.snapshot().laser_on);
    let scan: Scan = rig.client().get(&path::scan(&scan.id)).await?;
    assert_eq!(scan.state, ScanState::Aborted);
    assert!(
        (10..2_000).contains(&scan.columns),
        "{} columns",
        scan.columns
    );
    assert_eq!(scan.reason.as_deref(), Some("the service was stopped"));
    let next = rig.scan_to_result(&short("next")).await?;
    assert_eq!(next.scan.columns, 60);
    rig.end().await
}
