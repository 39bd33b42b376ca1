//! Results that somebody says to have whole, and which of them go.

use std::path::PathBuf;

use relief_api::{CreateToken, Event, Job, JobList, NewToken, Scan, SpoolEntry, path};
use reliefd::config::{Acknowledged, Unacknowledged};
use tokio::net::TcpStream;

use crate::client::exchange;
use crate::rig::Rig;

async fn acknowledge(rig: &Rig, result: &str) -> Job {
    rig.client.ask(&path::spool_ack(result)).await
}

fn folder(rig: &Rig, scan: &Scan) -> PathBuf {
    rig.daemon.spool_dir().join(&scan.id)
}

#[tokio::test(flavor = "multi_thread")]
async fn who_has_a_result_and_since_when_is_kept() {
    let rig = Rig::new().await;
    let (_, job) = rig.scan_to_result("a").await;
    let before: SpoolEntry = rig.client.get(&path::spool(&job.result)).await;
    assert_eq!(
        (before.acknowledged_at, before.acknowledged_by),
        (None, None)
    );
    let mut events = rig.client.events().await;
    let first = acknowledge(&rig, &job.result).await;
    assert_eq!(first.acknowledged_by.as_deref(), Some("socket"));
    assert!(first.acknowledged_at >= job.ended_at);
    let told = |event: &Event| match event {
        Event::Job(job) if job.acknowledged_at.is_some() => Some(job.clone()),
        _ => None,
    };
    assert_eq!(events.until(told).await.1, first);
    // Nothing else of it changes, and the first one counts, also after a restart.
    let unchanged = Job {
        acknowledged_at: None,
        acknowledged_by: None,
        ..first.clone()
    };
    assert_eq!(unchanged, job);
    assert_eq!(acknowledge(&rig, &job.result).await, first);
    let rig = rig.restart().await;
    assert_eq!(acknowledge(&rig, &job.result).await, first);
    let jobs: JobList = rig.client.get(path::JOBS).await;
    assert_eq!(jobs.jobs, std::slice::from_ref(&first));
    let entry: SpoolEntry = rig.client.get(&path::spool(&job.result)).await;
    assert_eq!(entry.files, before.files);
    assert_eq!(entry.acknowledged_at, first.acknowledged_at);
    assert_eq!(entry.acknowledged_by, first.acknowledged_by);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bearer_is_known_by_the_name_of_the_token() {
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    })
    .await;
    let (_, job) = rig.scan_to_result("a").await;
    let request = CreateToken {
        name: "desk".into(),
    };
    let desk: NewToken = rig.client.post(path::TOKENS, &request).await;
    let address = rig.daemon.listen().unwrap();
    let ask = async |fields: String| {
        let stream = TcpStream::connect(address).await.unwrap();
        let path = path::spool_ack(&job.result);
        exchange(stream, &format!("{address}{fields}"), "POST", &path, None).await
    };
    assert_eq!(ask(String::new()).await.status, 401);
    let reply = ask(format!("\r\nAuthorization: Bearer {}", desk.token)).await;
    assert_eq!(reply.status, 200);
    let kept = acknowledge(&rig, &job.result).await;
    assert_eq!(kept.acknowledged_by.as_deref(), Some("desk"));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn only_a_result_that_is_there_can_be_acknowledged() {
    let rig = Rig::new().await;
    let (_, job) = rig.scan_to_result("a").await;
    let spool = rig.daemon.spool_dir().to_owned();
    std::fs::create_dir(spool.join("left-over")).unwrap();
    let refused = async |result: &str| {
        let path = path::spool_ack(result);
        let problem = rig.client.request("POST", &path, None).await.problem();
        (problem.status, problem.kind)
    };
    assert_eq!(refused("none").await, (404, "not-in-spool".into()));
    assert_eq!(refused("..").await, (404, "not-in-spool".into()));
    // A part of a name is none.
    assert_eq!(
        refused(&job.result[1..]).await,
        (404, "not-in-spool".into())
    );
    assert_eq!(
        refused("left-over").await,
        (409, "no-record-of-result".into())
    );
    std::fs::remove_dir_all(spool.join(&job.result)).unwrap();
    assert_eq!(refused(&job.result).await, (404, "not-in-spool".into()));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn results_that_are_acknowledged_go_first_and_others_stay_if_they_are_to() {
    let rig = Rig::new().await;
    let (a, _) = rig.scan_to_result("a").await;
    let (b, _) = rig.scan_to_result("b").await;
    let (c, _) = rig.scan_to_result("c").await;
    // More than all may take together, whichever goes.
    std::fs::write(folder(&rig, &a).join("filler"), vec![0; 1_000_000]).unwrap();
    std::fs::write(folder(&rig, &b).join("filler"), vec![0; 2_000_000]).unwrap();
    let acknowledged = acknowledge(&rig, &b.id).await;
    // Acknowledged before the older one, and then room enough.
    let rig = rig
        .restart_with(|config| config.storage.results_mb = Some(3))
        .await;
    let there = |rig: &Rig| [&a, &b, &c].map(|scan| folder(rig, scan).exists());
    assert_eq!(there(&rig), [true, false, true]);
    // A client that has not heard the first answer is answered all the same.
    assert_eq!(acknowledge(&rig, &b.id).await, acknowledged);
    // Too much as the rest is, nobody has it.
    let rig = rig
        .restart_with(|config| {
            config.storage.results_mb = Some(1);
            config.storage.unacknowledged = Unacknowledged::Keep;
        })
        .await;
    assert_eq!(there(&rig), [true, false, true]);
    acknowledge(&rig, &c.id).await;
    let rig = rig
        .restart_with(|config| config.storage.acknowledged_days = Some(1))
        .await;
    assert_eq!(there(&rig), [true, false, true]);
    let rig = rig
        .restart_with(|config| config.storage.acknowledged = Acknowledged::Remove)
        .await;
    assert_eq!(there(&rig), [true, false, false]);
    rig.daemon.shutdown().await;
}
