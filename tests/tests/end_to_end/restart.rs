//! The service ends with work undone, and takes it up again.

use anyhow::Result;
use relief_api::{Event, Job, JobList, JobState, path};
use relief_tests::rig::{Rig, small_house};

#[tokio::test(flavor = "multi_thread")]
async fn jobs_cut_short_are_finished_after_a_restart_and_published_once() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let first = rig.scan_to_result(&super::named("house")).await?;
    let mut events = rig.client().events().await?;
    let running = rig.rerun(&first.scan.id, &super::slowly()).await?;
    let waiting = rig.rerun(&first.scan.id, &[]).await?;
    events.stage(running.id, "regrid").await?;
    let before = rig.result(&first.scan.id).await?;

    let rig = rig.restart(|_| {}).await?;
    let mut events = rig.client().events().await?;
    let taken_up: Job = rig.client().get(&path::job(running.id)).await?;
    assert!(!taken_up.state.is_over(), "{taken_up:?}");
    assert!(taken_up.ended_at.is_none() && taken_up.directory.is_none());
    assert_eq!(rig.result(&first.scan.id).await?, before);

    let mut published = Vec::new();
    let (_, last) = events
        .until(|event| {
            if let Event::Published { job, result, .. } = event {
                published.push((*job, result.clone()));
            }
            match event {
                Event::Job(job) if job.id == waiting.id && job.state.is_over() => Some(job.clone()),
                _ => None,
            }
        })
        .await?;
    assert_eq!((last.state, last.attempts), (JobState::Done, 1));
    let done: Job = rig.client().get(&path::job(running.id)).await?;
    assert_eq!(
        (done.state, done.attempts),
        (JobState::Done, 2),
        "begun twice"
    );
    assert_eq!(
        published,
        [(running.id, running.result.clone())],
        "published once"
    );
    let mut spooled = vec![first.scan.id.clone(), running.result, waiting.result];
    spooled.sort();
    assert_eq!(rig.spooled()?, spooled);

    // The first job's own result was not made again, and is not by yet another start.
    let rig = rig.restart(|_| {}).await?;
    let jobs: JobList = rig.client().get(path::JOBS).await?;
    let attempts: Vec<u32> = jobs.jobs.iter().rev().map(|job| job.attempts).collect();
    assert_eq!(attempts, [1, 2, 1]);
    assert_eq!(rig.spooled()?, spooled);
    assert_eq!(rig.result(&first.scan.id).await?, before);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_result_does_not_depend_on_having_been_cut_short() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let first = rig.scan_to_result(&super::named("house")).await?;
    let mut events = rig.client().events().await?;
    let job = rig.rerun(&first.scan.id, &super::slowly()).await?;
    events.stage(job.id, "regrid").await?;
    let rig = rig.restart(|_| {}).await?;
    let mut events = rig.client().events().await?;
    let cut_short = rig.job_done(&mut events, job.id).await?;
    let in_one_go = rig
        .rerun_to_result(&first.scan.id, &super::slowly())
        .await?;
    let one = rig.result(&cut_short.result).await?;
    let other = rig.result(&in_one_go.result).await?;
    assert_eq!(one.iges()?, other.iges()?);
    rig.end().await
}
