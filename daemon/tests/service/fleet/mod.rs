//! Jobs that are done elsewhere, by way of a NATS server.

mod login;
mod server;
mod trouble;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use job_queue::jetstream::{JetStreamQueue, Options};
use job_queue::{BenchName, Ending, JobQueue, Outcome, Worker};
use relief_api::{Event, Fleet, Job, JobState, Rerun, ScanState, path};
use reliefd::config::{NatsConfig, Role};
use reliefd::{BareWorker, Config, WorkerOptions};
use serde_json::json;
use tempfile::TempDir;

use crate::client::Events;
use crate::fake::COLUMNS;
use crate::rig::{GUARD, Rig, ended, job_over};
use server::Nats;

/// How long a worker may be silent, in milliseconds.
const SILENCE_MS: u64 = 1500;

fn bench(name: &str) -> BenchName {
    BenchName::try_from(name.to_owned()).unwrap()
}

/// A bench that does no jobs itself.
fn acquires(nats: &Nats) -> impl Fn(&mut Config) + use<> {
    let url = nats.url();
    move |config: &mut Config| {
        config.service.roles = [Role::Acquire, Role::Serve].into();
        config.nats.servers = vec![url.clone()];
        config.nats.bench = Some(bench("bench-1"));
        config.nats.silence_ms = Some(SILENCE_MS);
        config.nats.compute_when_away = false;
        // A worker may be done with what is taken back from it meanwhile: its result stays for so long.
        config.nats.unneeded_s = 10;
    }
}

/// One that does its jobs as soon as the server is away, and not only for a moment.
fn may_do_its_own(nats: &Nats) -> impl Fn(&mut Config) + use<> {
    let own = acquires(nats);
    move |config: &mut Config| {
        own(config);
        config.nats.compute_when_away = true;
        config.nats.away_s = 1;
    }
}

async fn rig(nats: &Nats) -> Rig {
    Rig::start(tempfile::tempdir().unwrap(), acquires(nats)).await
}

/// A worker in a thread, which ends with this.
struct Hired {
    worker: BareWorker,
    thread: Option<JoinHandle<u64>>,
    _folder: TempDir,
}

impl Hired {
    fn new(nats: &Nats, name: &str) -> Self {
        Self::with(nats, name, |_| {})
    }

    fn with(nats: &Nats, name: &str, more: impl FnOnce(&mut NatsConfig)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut config = NatsConfig {
            servers: vec![nats.url()],
            bench: Some(bench(name)),
            silence_ms: Some(SILENCE_MS),
            ..NatsConfig::default()
        };
        more(&mut config);
        let options = WorkerOptions {
            nats: config,
            workers: 1,
            threads: 1,
            folder: folder.path().to_owned(),
            idle: None,
        };
        let worker = BareWorker::default();
        let its = worker.clone();
        let thread = std::thread::spawn(move || its.run(&options).unwrap());
        Self {
            worker,
            thread: Some(thread),
            _folder: folder,
        }
    }

    /// Ends it; gives how many orders it has taken.
    fn dismiss(mut self) -> u64 {
        self.worker.stop();
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Hired {
    fn drop(&mut self) {
        self.worker.stop();
    }
}

/// The queue, as a test sees it.
async fn queue(nats: &Nats) -> Arc<JetStreamQueue> {
    let mut options = Options::new(vec![nats.url()]);
    options.ack_wait = Duration::from_millis(SILENCE_MS);
    let handle = tokio::runtime::Handle::current();
    blocking(move || {
        let queue = JetStreamQueue::new(options, handle).unwrap();
        queue.wait_connected(GUARD).unwrap();
        Arc::new(queue)
    })
    .await
}

async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    tokio::task::spawn_blocking(work).await.unwrap()
}

/// Waits until something is so.
async fn until<T>(what: &str, mut is_so: impl AsyncFnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = is_so().await {
            return found;
        }
        assert!(begun.elapsed() < GUARD, "{what} has not come to be");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Waits until the server has one order, which nobody has taken.
async fn an_order_waits(nats: &Nats) {
    let watcher = queue(nats).await;
    until("the order on the server", async || {
        let watcher = Arc::clone(&watcher);
        let depth = blocking(move || watcher.depth().unwrap());
        (depth.await.waiting.values().sum::<u64>() == 1).then_some(())
    })
    .await;
}

async fn job(rig: &Rig, id: u64) -> Job {
    rig.client.get(&path::job(id)).await
}

/// Nothing of any job is left on the server.
async fn all_is_cleared(nats: &Nats) {
    let queue = queue(nats).await;
    let begun = Instant::now();
    loop {
        let queue = Arc::clone(&queue);
        let left = blocking(move || {
            let (of, depot) = (bench("bench-1"), queue.depot());
            let depth = queue.depth().unwrap();
            (
                queue.standings(&of).unwrap(),
                depth.waiting.values().sum::<u64>() + depth.running,
                depot.list(&of).unwrap(),
            )
        })
        .await;
        if left.0.is_empty() && left.1 == 0 && left.2.is_empty() {
            return;
        }
        assert!(begun.elapsed() < GUARD, "left on the server: {left:?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// The files of a result but for those that tell how long it took, and of what.
fn files(directory: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let name = PathBuf::from(path.file_name().unwrap());
        let timed = ["report.json", "manifest.json"];
        let timed = timed.iter().any(|one| name == Path::new(one));
        let is_page = name.extension().is_some_and(|e| e == "html" || e == "pdf");
        if !timed && !is_page {
            files.push((name, std::fs::read(path).unwrap()));
        }
    }
    files.sort();
    files
}

/// A job that takes long, once a worker is in its midst.
async fn begun_slow(rig: &Rig, events: &mut Events, scan: &str) -> Job {
    let slow = Rerun {
        settings: [("regrid.draws".to_owned(), json!(100_000))].into(),
        ..Rerun::default()
    };
    let slow: Job = rig.client.post(&path::scan_rerun(scan), &slow).await;
    let at_it = |event: &Event| match event {
        Event::Progress { job, stage, .. } if *job == slow.id && stage == "regrid" => Some(()),
        _ => None,
    };
    events.until(at_it).await;
    slow
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_done_elsewhere_and_its_result_comes_home() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let worker = Hired::new(&nats, "hand-1");
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("part").await;
    let published = |event: &Event| match event {
        Event::Published { result, files, .. } => Some((result.clone(), files.clone())),
        _ => None,
    };
    let (story, (result, names)) = events.until(published).await;
    assert_eq!(result, scan.id);
    assert!(names.contains(&"part.igs".to_owned()), "{names:?}");
    // Its states are those of any job, and so is its progress.
    let mut states: Vec<JobState> = story
        .iter()
        .filter_map(|event| match event {
            Event::Job(job) => Some(job.state),
            _ => None,
        })
        .collect();
    states.dedup();
    assert_eq!(
        states,
        [JobState::Queued, JobState::Running, JobState::Done]
    );
    let is_told = |wanted: &str| {
        let told =
            |event: &Event| matches!(event, Event::Progress { stage, .. } if stage == wanted);
        story.iter().any(told)
    };
    assert!(is_told("fetch") && is_told("segment"), "{story:?}");
    let done = job(&rig, 1).await;
    assert_eq!((done.attempts, done.cut_short), (1, 0));
    assert_eq!(done.worker.as_deref(), Some("hand-1"));
    assert!(done.timings.iter().any(|timing| timing.stage == "regrid"));
    let elsewhere = files(Path::new(&done.directory.unwrap()));
    all_is_cleared(&nats).await;
    assert_eq!(worker.dismiss(), 1);

    // The same as when the service does it itself, byte for byte.
    let rig = rig
        .restart_with(|config| config.nats = NatsConfig::default())
        .await;
    let mut events = rig.client.events().await;
    let again: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    let again = job_over(&mut events, &rig, again.id).await;
    assert_eq!(again.worker, None);
    let here = files(Path::new(&again.directory.unwrap()));
    assert!(here.len() > 3, "{here:?}");
    assert!(elsewhere == here, "another result than here");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_goes_on_without_the_server_and_is_handed_over_when_it_is_back() {
    let Some(nats) = Nats::started() else {
        return;
    };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    rig.scanner.allow(COLUMNS / 2);
    let scan = rig.start_scan("part").await;
    let half = |event: &Event| match event {
        Event::Column { columns, .. } if *columns == COLUMNS / 2 => Some(()),
        _ => None,
    };
    events.until(half).await;
    nats.stop();
    rig.scanner.allow_all();
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Complete);
    let fleet: Fleet = rig.client.get(path::FLEET).await;
    assert!(fleet.is_used && !fleet.is_connected, "{fleet:?}");
    assert_eq!(job(&rig, 1).await.state, JobState::Queued);

    nats.start();
    let worker = Hired::new(&nats, "hand-1");
    let done = job_over(&mut events, &rig, 1).await;
    assert_eq!(done.state, JobState::Done, "{:?}", done.error);
    all_is_cleared(&nats).await;
    assert_eq!(worker.dismiss(), 1);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_go_elsewhere_is_done_here_if_it_may() {
    let Some(nats) = Nats::new() else { return };
    let rig = Rig::start(tempfile::tempdir().unwrap(), may_do_its_own(&nats)).await;
    let (_, done) = rig.scan_to_result("part").await;
    assert_eq!((done.state, done.worker), (JobState::Done, None));
    nats.start();
    all_is_cleared(&nats).await;
    rig.daemon.shutdown().await;
}

/// An order that stands on the server when the server goes, and is done here meanwhile.
#[tokio::test(flavor = "multi_thread")]
async fn what_was_handed_over_and_then_done_here_is_taken_back() {
    let Some(nats) = Nats::started() else {
        return;
    };
    let rig = Rig::start(tempfile::tempdir().unwrap(), may_do_its_own(&nats)).await;
    until("the server reached", async || {
        let fleet: Fleet = rig.client.get(path::FLEET).await;
        fleet.is_connected.then_some(())
    })
    .await;
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    let watcher = queue(&nats).await;
    until("the order on the server", async || {
        let still = job(&rig, 1).await;
        assert_eq!(still.state, JobState::Queued, "{still:?}");
        let watcher = Arc::clone(&watcher);
        let count = blocking(move || watcher.standings(&bench("bench-1")).unwrap().len());
        (count.await == 1).then_some(())
    })
    .await;
    nats.stop();
    let done = job_over(&mut events, &rig, 1).await;
    assert_eq!((done.state, &done.worker), (JobState::Done, &None));
    nats.start();
    let worker = Hired::new(&nats, "hand-1");
    all_is_cleared(&nats).await;
    assert_eq!(job(&rig, 1).await, done);
    drop(worker);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_elsewhere_are_cancelled_and_retried_as_here() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    let _: Job = rig.client.ask(&path::job_cancel(1)).await;
    let over = job_over(&mut events, &rig, 1).await;
    assert_eq!((over.state, over.attempts), (JobState::Cancelled, 0));
    all_is_cleared(&nats).await;

    let worker = Hired::new(&nats, "hand-1");
    let slow = begun_slow(&rig, &mut events, &scan.id).await;
    let _: Job = rig.client.ask(&path::job_cancel(slow.id)).await;
    let over = job_over(&mut events, &rig, slow.id).await;
    assert_eq!((over.state, over.attempts), (JobState::Cancelled, 1));

    let _: Job = rig.client.ask(&path::job_retry(1)).await;
    let over = job_over(&mut events, &rig, 1).await;
    assert_eq!(over.state, JobState::Done, "{:?}", over.error);
    all_is_cleared(&nats).await;
    drop(worker);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_outlives_its_worker_and_its_bench() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    // A worker that takes it and dies.
    let dying = queue(&nats).await;
    blocking(move || {
        let taken = dying.take(&Worker::named("dying"), GUARD).unwrap();
        drop(taken.unwrap());
    })
    .await;
    until("the bench has heard of it", async || {
        (job(&rig, 1).await.state == JobState::Running).then_some(())
    })
    .await;
    // The service ends, and another one starts, while nobody works on it.
    let rig = rig.restart_with(acquires(&nats)).await;
    let mut events = rig.client.events().await;
    let worker = Hired::new(&nats, "hand-1");
    let done = job_over(&mut events, &rig, 1).await;
    assert_eq!(done.state, JobState::Done, "{:?}", done.error);
    assert_eq!(done.worker.as_deref(), Some("hand-1"));
    let results = std::fs::read_dir(rig.daemon.spool_dir()).unwrap().count();
    assert_eq!(results, 1);
    all_is_cleared(&nats).await;
    drop(worker);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_worker_says_to_have_made_is_looked_at() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let mut events = rig.client.events().await;
    let liar = queue(&nats).await;
    let stop = BareWorker::default();
    let lying = std::thread::spawn(move || {
        let mut lies = 0;
        while lies < 6 {
            let taken = liar.take(&Worker::named("liar"), GUARD).unwrap();
            let mut lease = taken.unwrap();
            let chunk = json!({ "sha256": "0".repeat(64), "bytes": 1 });
            let parcel = json!({ "sha256": "0".repeat(64), "bytes": 1, "chunks": [chunk] });
            let file = json!({ "name": "a.igs", "bytes": 1, "sha256": "0".repeat(64) });
            let bundle = json!({ "files": [file], "parcel": parcel });
            let outcome = Outcome {
                ending: Ending::Done {
                    result: json!({ "delivered": { "bundle": bundle, "version": "0" } }),
                    left_out: Vec::new(),
                },
                timings: Vec::new(),
            };
            lease.settle(&outcome).unwrap();
            lies += 1;
        }
    });
    let scan = rig.start_scan("part").await;
    ended(&mut events, &scan.id).await;
    let over = job_over(&mut events, &rig, 1).await;
    lying.join().unwrap();
    stop.stop();
    assert_eq!((over.state, over.attempts), (JobState::Failed, 6));
    let error = over.error.unwrap();
    assert!(
        error.contains("what a worker has made: chunk 1 of 1"),
        "{error}"
    );
    assert_eq!(
        std::fs::read_dir(rig.daemon.spool_dir()).unwrap().count(),
        0
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_works_for_others_and_says_what_it_is_there_for() {
    let Some(nats) = Nats::started() else { return };
    let rig = rig(&nats).await;
    let url = nats.url();
    let works = move |config: &mut Config| {
        config.service.roles = [Role::Work, Role::Serve].into();
        config.nats.servers = vec![url];
        config.nats.bench = Some(bench("big-1"));
        config.nats.silence_ms = Some(SILENCE_MS);
    };
    let big = Rig::start(tempfile::tempdir().unwrap(), works).await;
    let (_, done) = rig.scan_to_result("part").await;
    assert_eq!(done.state, JobState::Done, "{:?}", done.error);
    assert_eq!(done.worker.as_deref(), Some("big-1-worker-1"));
    let fleet = until("both in the list", async || {
        let fleet: Fleet = big.client.get(path::FLEET).await;
        (fleet.workers.len() == 1 && fleet.benches.len() == 2).then_some(fleet)
    })
    .await;
    assert_eq!(fleet.workers[0].name, "big-1-worker-1");
    let metrics = big.client.request("GET", path::METRICS, None).await.body;
    let metrics = String::from_utf8(metrics).unwrap();
    assert!(metrics.contains("relief_fleet_workers 1"), "{metrics}");
    let refused = big.client.request("POST", path::SCANS, Some("{}")).await;
    assert_eq!(refused.status, 409);
    assert!(refused.problem().kind.ends_with("takes-no-scans"));
    big.daemon.shutdown().await;
    rig.daemon.shutdown().await;
}
