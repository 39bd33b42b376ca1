//! What goes wrong while jobs are done elsewhere.

use std::sync::Arc;

use relief_api::{Fleet, Job, JobState, path};
use rustix::io::Errno;
use storage::HinderedDisk;

use super::*;
use crate::ailing::disk::Ailing;

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_is_stopped_gives_its_job_back() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let first = Hired::new(&nats, "hand-1");
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    assert_eq!(job_over(&mut events, &rig, 1).await.state, JobState::Done);
    let slow = begun_slow(&rig, &mut events, &scan.id).await;
    // It does not wait for the job's end, which is far.
    assert_eq!(blocking(move || first.dismiss()).await, 2);
    until("it waits for another worker", async || {
        (job(&rig, slow.id).await.state == JobState::Queued).then_some(())
    })
    .await;
    let watcher = queue(&nats).await;
    let key = job_queue::JobKey {
        bench: bench("bench-1"),
        job: slow.id,
    };
    let standing = blocking(move || watcher.standing(&key).unwrap().unwrap()).await;
    assert_eq!((standing.attempts, standing.cut_short), (1, 0));
    let _: Job = rig.client.ask(&path::job_cancel(slow.id)).await;
    let over = job_over(&mut events, &rig, slow.id).await;
    assert_eq!(over.state, JobState::Cancelled);
    all_is_cleared(&nats).await;
    rig.daemon.shutdown().await;
}

/// As servers do that were killed: first one that waits, then one whose worker is gone, too.
#[tokio::test(flavor = "multi_thread")]
async fn an_order_that_the_server_loses_is_put_again() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    an_order_waits(&nats).await;
    nats.lose_orders();
    let first = Hired::new(&nats, "hand-1");
    assert_eq!(job_over(&mut events, &rig, 1).await.state, JobState::Done);

    let slow = begun_slow(&rig, &mut events, &scan.id).await;
    nats.lose_orders();
    // It gives back what is not there any more, so that nobody is told of it.
    blocking(move || first.dismiss()).await;
    let second = Hired::new(&nats, "hand-2");
    until("the other worker at the job", async || {
        let job = job(&rig, slow.id).await;
        (job.state == JobState::Running && job.worker.as_deref() == Some("hand-2")).then_some(())
    })
    .await;
    let _: Job = rig.client.ask(&path::job_cancel(slow.id)).await;
    let over = job_over(&mut events, &rig, slow.id).await;
    assert_eq!(over.state, JobState::Cancelled);
    all_is_cleared(&nats).await;
    drop(second);
    rig.daemon.shutdown().await;
}

/// Its jobs begin at 1 again, where another one waits.
#[tokio::test(flavor = "multi_thread")]
async fn a_bench_that_lost_its_records_takes_no_other_result_for_its_own() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let lost = rig.start_scan("lost").await;
    ended(&mut events, &lost.id).await;
    an_order_waits(&nats).await;
    let Rig { daemon, folder, .. } = rig;
    daemon.shutdown().await;
    std::fs::remove_dir_all(folder.path().join("state")).unwrap();
    // Turns are told apart by the second in which a job was made.
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let rig = Rig::start(folder, acquires(&nats)).await;
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("new").await;
    ended(&mut events, &scan.id).await;
    let worker = Hired::new(&nats, "hand-1");
    let done = job_over(&mut events, &rig, 1).await;
    assert_eq!((done.state, done.scan), (JobState::Done, scan.id));
    assert!(Path::new(&done.directory.unwrap()).join("new.igs").exists());
    all_is_cleared(&nats).await;
    drop(worker);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_spool_that_takes_no_result_is_told_at_once_and_asks_for_no_other() {
    let Some(nats) = Nats::started() else { return };
    let disk = Ailing::default();
    let hindered = Arc::new(HinderedDisk(disk.clone()));
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start_on(folder, hindered, acquires(&nats)).await;
    let mut events = rig.client.events().await;
    disk.refuse(".igs", Errno::NOSPC);
    let worker = Hired::new(&nats, "hand-1");
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    let over = job_over(&mut events, &rig, 1).await;
    assert_eq!((over.state, over.attempts), (JobState::Failed, 1));
    let error = over.error.unwrap();
    assert!(
        error.contains("cannot write a result in the spool") && error.contains("No space left"),
        "{error}"
    );
    assert_eq!(
        over.hint.as_deref(),
        Some("make room on the disk, then retry the job")
    );
    all_is_cleared(&nats).await;
    disk.heal();
    let _: Job = rig.client.ask(&path::job_retry(1)).await;
    let over = job_over(&mut events, &rig, 1).await;
    assert_eq!(over.state, JobState::Done, "{:?}", over.error);
    drop(worker);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn why_no_server_is_reached_is_told() {
    let Some(nats) = Nats::new() else { return };
    let rig = rig(&nats).await;
    let told = until("the reason", async || {
        let fleet: Fleet = rig.client.get(path::FLEET).await;
        assert!(!fleet.is_connected);
        fleet.problem.filter(|problem| problem.contains("refused"))
    })
    .await;
    assert!(told.contains(&nats.url()), "{told}");
    rig.daemon.shutdown().await;
}

/// The bench's own server keeps nothing: what has to wait waits in the bench's records.
#[tokio::test(flavor = "multi_thread")]
async fn a_leaf_at_the_bench_may_come_and_go() {
    let Some((leaf, hub)) = Nats::leaf() else {
        return;
    };
    let worker = Hired::new(&hub, "hand-1");
    let own = acquires(&leaf);
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        own(config);
        config.nats.domain = Some("hub".to_owned());
    })
    .await;
    let mut events = rig.client.events().await;
    rig.start_scan("first").await;
    assert_eq!(job_over(&mut events, &rig, 1).await.state, JobState::Done);
    // Else what is left of it would stay for as long as it might be needed.
    all_is_cleared(&hub).await;
    leaf.stop();
    let scan = rig.start_scan("second").await;
    ended(&mut events, &scan.id).await;
    assert_eq!(job(&rig, 2).await.state, JobState::Queued);
    leaf.start();
    let done = job_over(&mut events, &rig, 2).await;
    assert_eq!((done.state, done.attempts), (JobState::Done, 1));
    assert_eq!(worker.dismiss(), 2);
    all_is_cleared(&hub).await;
    rig.daemon.shutdown().await;
}
