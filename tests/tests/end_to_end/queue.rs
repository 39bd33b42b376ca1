//! Jobs: beside each other, again, given up and taken up.

use anyhow::{Context, Result};
use relief_api::{Event, Job, JobState, Scan, path};
use relief_tests::rig::{Refused, Rig, small_house};

#[tokio::test(flavor = "multi_thread")]
async fn a_second_scan_is_taken_while_the_first_is_processed() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let first = rig.scan_to_result(&super::named("first")).await?;
    let mut events = rig.client().events().await?;
    let job = rig.rerun(&first.scan.id, &super::slowly()).await?;
    events.stage(job.id, "regrid").await?;

    let second = rig.scan(&super::named("second")).await?;
    // Both must come; which of the two comes first is what is looked at.
    let (mut complete, mut done) = (None, None);
    let mut place = 0;
    events
        .until(|event| {
            place += 1;
            match event {
                Event::Scan(scan) if scan.id == second.id && scan.state.is_over() => {
                    complete = Some((place, scan.clone()));
                }
                Event::Job(told) if told.id == job.id && told.state.is_over() => {
                    done = Some((place, told.clone()));
                }
                _ => {}
            }
            (complete.is_some() && done.is_some()).then_some(())
        })
        .await?;
    let (scanned_at, second) = complete.context("the scan's end")?;
    let (done_at, job) = done.context("the job's end")?;
    assert!(scanned_at < done_at, "the scan waited for the job");
    assert_eq!((second.columns, job.state), (60, JobState::Done));

    // A third, at the very moment at which the job of the second waits or begins.
    let third = rig.scan_to_result(&super::named("third")).await?;
    let job: Job = rig.client().get(&path::job(second.jobs[0])).await?;
    assert_eq!(job.state, JobState::Done, "jobs are done in their order");
    assert_eq!(rig.spooled()?.len(), 4);
    let files = rig.result(&third.scan.id).await?;
    assert!(files.file("third.igs").is_ok());
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_scan_is_refused_while_the_first_is_taken() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let control = rig.control()?;
    control.step_columns(Some(5));
    let mut events = rig.client().events().await?;
    let first = rig.scan(&super::named("first")).await?;
    events.columns(&first.id, 5).await?;
    let refused = rig.scan(&super::named("second")).await;
    let problem = refused.expect_err("one at a time").downcast::<Refused>()?.0;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (409, "scanner-busy")
    );
    assert!(problem.detail.contains(&first.id), "{problem}");
    assert!(problem.hint.is_some_and(|hint| hint.contains("abort")));
    control.step_columns(None);
    events.scan_complete(&first.id).await?;
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rerun_with_other_settings_makes_another_result() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let first = rig.scan_to_result(&super::named("house")).await?;
    let before = rig.result(&first.scan.id).await?;

    let coarse = rig
        .rerun_to_result(&first.scan.id, &[("regrid.pitch_mm", 2.5.into())])
        .await?;
    let paper = rig
        .rerun_to_result(&first.scan.id, &[("reconstruct.method", "shim-lee".into())])
        .await?;
    let entities = rig
        .rerun_to_result(&first.scan.id, &[("deliverables.entities", 128.into())])
        .await?;
    let filled = [("fill.mode", "auto".into()), ("fill.max_size_mm", 6.into())];
    let filled = rig.rerun_to_result(&first.scan.id, &filled).await?;
    let mut spooled = vec![
        first.scan.id.clone(),
        filled.result.clone(),
        coarse.result.clone(),
        paper.result.clone(),
        entities.result.clone(),
    ];
    spooled.sort();
    assert_eq!(rig.spooled()?, spooled, "five results side by side");
    assert_eq!(rig.result(&first.scan.id).await?, before, "untouched");

    let settings = |report: serde_json::Value| report["settings"].clone();
    let coarse = rig.result(&coarse.result).await?;
    assert_eq!(settings(coarse.json("report.json")?)["pitch_mm"], 2.5);
    let paper = rig.result(&paper.result).await?;
    assert_eq!(settings(paper.json("report.json")?)["method"], "shim-lee");
    let entities = rig.result(&entities.result).await?;
    assert_eq!(
        settings(entities.json("report.json")?)["iges_entities"],
        128
    );
    let filled = rig.result(&filled.result).await?.json("report.json")?;
    assert_eq!(filled["fill"]["max_size_mm"], 6.0);
    assert_eq!(filled["settings"]["fill"], "auto");
    assert!(before.json("report.json")?.get("fill").is_none());
    let (parametric, rational) = (before.iges()?, entities.iges()?);
    for (file, present, absent) in [(parametric, 114, 128), (rational, 128, 114)] {
        assert!(relief_tests::iges::entities(file, present)? >= 4);
        assert_eq!(relief_tests::iges::entities(file, absent)?, 0);
    }
    for other in [&coarse, &paper, &entities] {
        assert_ne!(other.iges()?, before.iges()?);
    }
    let scan: Scan = rig.client().get(&path::scan(&first.scan.id)).await?;
    assert_eq!(scan.jobs.len(), 5);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_cancelled_and_retried() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let first = rig.scan_to_result(&super::named("house")).await?;
    let mut events = rig.client().events().await?;
    let running = rig.rerun(&first.scan.id, &super::slowly()).await?;
    let waiting = rig.rerun(&first.scan.id, &[]).await?;
    events.stage(running.id, "regrid").await?;

    let cancelled: Job = rig.client().ask(&path::job_cancel(waiting.id)).await?;
    assert_eq!(
        (cancelled.state, cancelled.attempts),
        (JobState::Cancelled, 0)
    );
    let _: Job = rig.client().ask(&path::job_cancel(running.id)).await?;
    let cancelled = events.job_becomes(running.id, JobState::is_over).await?;
    assert_eq!(
        (cancelled.state, cancelled.attempts),
        (JobState::Cancelled, 1)
    );
    assert_eq!(
        rig.spooled()?,
        [first.scan.id.as_str()],
        "nothing is left of them"
    );

    let again = rig.client().ask::<Job>(&path::job_cancel(running.id)).await;
    let refused = again.expect_err("it is over").downcast::<Refused>()?.0;
    assert_eq!(
        (refused.status, refused.kind.as_str()),
        (409, "wrong-job-state")
    );
    assert_eq!(
        refused.detail,
        format!(
            "the job {} is cancelled and cannot be cancelled",
            running.id
        )
    );

    for (id, attempts) in [(running.id, 2), (waiting.id, 1)] {
        let queued: Job = rig.client().ask(&path::job_retry(id)).await?;
        assert_eq!(queued.state, JobState::Queued);
        let done = rig.job_done(&mut events, id).await?;
        assert_eq!(done.attempts, attempts);
        assert!(rig.result(&done.result).await?.iges().is_ok());
    }
    let again = rig.client().ask::<Job>(&path::job_retry(running.id)).await;
    let refused = again.expect_err("it is done").downcast::<Refused>()?.0;
    assert_eq!(refused.kind, "wrong-job-state");
    assert_eq!(rig.spooled()?.len(), 3);
    rig.end().await
}
