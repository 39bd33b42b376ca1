//! The power fails at every sync, and between them, of a scan and its jobs.
//!
//! A service takes a scan and processes it twice, on a disk that notes every step, with a webhook
//! whose receiver is away. From the
//! notes what a medium would hold is made anew for each moment: with nothing that was not
//! synced, with all of it, and with chance parts of it. A fresh service is started on each, and
//! for some of them the power fails once more while that one takes up what it found.

mod dice;
mod medium;
mod recorder;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use deliverables::Manifest;
use relief_api::{
    Event, Job, JobState, LaserLog, LaserState, PlanRequest, Rerun, Scan, ScanState, StartScan,
    WebhookEvent, WebhookMessage, path,
};
use reliefd::config::{Retry, WebhookConfig};
use reliefd::{Config, Daemon};
use scan_record::{JournalReader, RawColumn};

use crate::client::Client;
use crate::fake::FakeScanner;
use crate::rig::{Rig, config, ended, job_over, settled};
use crate::webhooks::receiver::Receiver;
use crate::webhooks::webhook;
use dice::Dice;
use medium::{Loss, Medium};
use recorder::{Recorder, Step, Told};

const COLUMNS: u32 = 24;

/// What the service did while the power was on.
struct Story {
    steps: Vec<Step>,
    /// Its folder, whose name stands in the steps.
    folder: tempfile::TempDir,
    scan: String,
    columns: Vec<RawColumn>,
    results: Results,
}

/// What a webhook was told: the event, and the scan or job.
type Heard = BTreeSet<(WebhookEvent, String)>;

/// A webhook whose receiver is away, in a folder of its own.
fn telling_nobody(folder: &Path) -> WebhookConfig {
    let mut webhook = webhook(folder, "lab", "http://127.0.0.1:9/");
    // Nobody waits for that here.
    webhook.retry = Retry::default();
    webhook
}

/// Listens until the webhook was told all that is wanted.
fn listen(receiver: &Receiver, wanted: &Heard, heard: &mut Heard) {
    while !wanted.is_subset(heard) {
        let WebhookMessage { event, data, .. } = receiver.next().message();
        let what = match data.job {
            Some(job) => job.id.to_string(),
            None => data.scan.unwrap().id,
        };
        heard.insert((event, what));
    }
}

/// Files by name of each published result.
type Results = BTreeMap<String, BTreeMap<String, Vec<u8>>>;

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

fn columns(journal: &Path) -> Vec<RawColumn> {
    let mut columns = Vec::new();
    // Without a header there is no column either.
    if let Ok(mut reader) = JournalReader::open(journal) {
        while let Some(column) = reader.next_column().unwrap() {
            columns.push(column);
        }
    }
    columns
}

async fn published(events: &mut crate::client::Events, of: &Job) {
    let find = |event: &Event| match event {
        Event::Published { job, .. } if *job == of.id => Some(()),
        _ => None,
    };
    events.until(find).await;
}

/// Takes a scan, and processes it twice.
async fn story() -> Story {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::default();
    let scanner = FakeScanner::new();
    let told = recorder.clone();
    scanner.on_acknowledge(move |column| told.tell(Told::Acknowledged(column)));
    let disk = Arc::new(recorder.clone());
    let mut config = config(folder.path());
    config.webhooks = vec![telling_nobody(folder.path())];
    let daemon = Daemon::start_on(config, scanner.clone(), disk)
        .await
        .unwrap();
    let client = Client::new(daemon.socket());
    let mut events = client.events().await;
    let request = StartScan {
        name: "roof".into(),
        plan: PlanRequest {
            columns: Some(COLUMNS),
            pitch_mm: Some(0.5),
            samples: Some(24),
            ..PlanRequest::default()
        },
        ..StartScan::default()
    };
    scanner.allow(0);
    let scan: Scan = client.post(path::SCANS, &request).await;
    recorder.tell(Told::Accepted(scan.id.clone()));
    scanner.allow_all();
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Complete, "{:?}", scan.reason);
    recorder.tell(Told::Complete(scan.id.clone()));
    let rig = Rig {
        daemon,
        client,
        scanner,
        scanners: BTreeMap::new(),
        folder,
    };
    let first = job_over(&mut events, &rig, scan.jobs[0]).await;
    assert_eq!(first.state, JobState::Done, "{:?}", first.error);
    published(&mut events, &first).await;
    recorder.tell(Told::Published(first.result.clone()));
    let rerun: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    recorder.tell(Told::Queued(rerun.id));
    let rerun = job_over(&mut events, &rig, rerun.id).await;
    assert_eq!(rerun.state, JobState::Done, "{:?}", rerun.error);
    published(&mut events, &rerun).await;
    recorder.tell(Told::Published(rerun.result.clone()));

    let columns = columns(&rig.journal(&scan.id));
    assert_eq!(columns.len() as u32, COLUMNS);
    let results = [first.result, rerun.result]
        .map(|result| {
            let files = files(&rig.daemon.spool_dir().join(&result));
            (result, files)
        })
        .into();
    rig.daemon.shutdown().await;
    retire(rig.folder.path(), &scan.id, &recorder).await;
    Story {
        steps: recorder.steps(),
        folder: rig.folder,
        scan: scan.id,
        columns,
        results,
    }
}

/// Starts the service once more, to whom the results are too large: the oldest has to go.
async fn retire(folder: &Path, result: &str, recorder: &Recorder) {
    let mut config = config(folder);
    config.storage.results_mb = Some(1);
    config.webhooks = vec![telling_nobody(folder)];
    let place = config.service.spool_dir.join(result);
    fs::write(place.join("padding"), vec![1; 2_000_000]).unwrap();
    recorder.tell(Told::Retired(result.to_owned()));
    let disk = Arc::new(recorder.clone());
    let daemon = Daemon::start_on(config, FakeScanner::new(), disk);
    let daemon = daemon.await.unwrap();
    daemon.shutdown().await;
    assert!(!place.exists(), "it was kept");
}

/// What may be relied on after some steps.
#[derive(Default)]
struct Promised {
    accepted: bool,
    columns: usize,
    complete: bool,
    queued: Option<u64>,
    published: BTreeSet<String>,
    /// Results that may be there or not.
    retired: BTreeSet<String>,
}

impl Promised {
    fn by<'a>(steps: impl IntoIterator<Item = &'a Step>) -> Self {
        let mut promised = Self::default();
        for step in steps {
            match step {
                Step::Told(Told::Accepted(_)) => promised.accepted = true,
                Step::Told(Told::Acknowledged(column)) => promised.columns = *column as usize + 1,
                Step::Told(Told::Complete(_)) => promised.complete = true,
                Step::Told(Told::Queued(job)) => promised.queued = Some(*job),
                Step::Told(Told::Published(result)) => {
                    promised.published.insert(result.clone());
                }
                Step::Told(Told::Retired(result)) => {
                    promised.retired.insert(result.clone());
                }
                _ => {}
            }
        }
        promised
    }
}

/// What is left when the power fails after these steps.
fn survivors<'a>(mut medium: Medium<'a>, happened: &'a [Step], loss: Loss) -> tempfile::TempDir {
    for step in happened {
        medium.step(step);
    }
    let folder = tempfile::tempdir().unwrap();
    medium.write_survivors(loss, folder.path());
    folder
}

fn place(steps: usize, loss: Loss) -> String {
    format!("{loss:?} of what was not synced lost after {steps} steps")
}

/// A service that tells this receiver.
async fn start(folder: tempfile::TempDir, recorder: Recorder, receiver: &Receiver) -> Rig {
    let webhook = webhook(folder.path(), "lab", &receiver.url());
    let change = |config: &mut Config| config.webhooks = vec![webhook];
    Rig::start_on(folder, Arc::new(recorder), change).await
}

/// Starts a service on what is left after so many steps, and holds it to every promise.
async fn revive(story: &Story, steps: usize, loss: Loss) {
    let happened = &story.steps[..steps];
    let folder = survivors(Medium::new(story.folder.path()), happened, loss);
    let receiver = Receiver::new([]);
    // On a disk that waits for no medium.
    let rig = start(folder, Recorder::default(), &receiver).await;
    let promised = Promised::by(happened);
    let (_, wanted) = hold(story, &story.results, &rig, &promised, &place(steps, loss)).await;
    listen(&receiver, &wanted, &mut Heard::new());
    rig.daemon.shutdown().await;
}

/// The same, and the power fails again at every sync of what the service does then. Gives the
/// number of media on which another was started.
async fn revive_again(story: &Story, steps: usize, loss: Loss) -> usize {
    let happened = &story.steps[..steps];
    let folder = survivors(Medium::new(story.folder.path()), happened, loss);
    let place_of_first = place(steps, loss);
    let found = folder.path().to_owned();
    let medium = Medium::of(&found);
    let recorder = Recorder::default();
    let receiver = Receiver::new([]);
    let rig = start(folder, recorder.clone(), &receiver).await;
    let promised = Promised::by(happened);
    let (results, wanted) = hold(story, &story.results, &rig, &promised, &place_of_first).await;
    let mut heard = Heard::new();
    listen(&receiver, &wanted, &mut heard);
    for result in results.keys() {
        recorder.tell(Told::Published(result.clone()));
    }
    rig.daemon.shutdown().await;

    let recovery = recorder.steps();
    let mut media = 0;
    for at in syncs(&recovery) {
        for (steps, loss) in [(at, Loss::Some(at as u64)), (at + 1, Loss::All)] {
            let again = &recovery[..steps];
            let folder = survivors(medium.clone(), again, loss);
            let receiver = Receiver::new([]);
            let rig = start(folder, Recorder::default(), &receiver).await;
            let promised = Promised::by(happened.iter().chain(again));
            let place = format!("{place_of_first}, then {}", place(steps, loss));
            let (_, wanted) = hold(story, &results, &rig, &promised, &place).await;
            // What was heard before the power failed need not be told again.
            listen(&receiver, &wanted, &mut heard.clone());
            rig.daemon.shutdown().await;
            media += 1;
        }
    }
    media
}

fn syncs(steps: &[Step]) -> Vec<usize> {
    let is_sync = |step: &Step| matches!(step, Step::SyncFile { .. } | Step::SyncDir { .. });
    (0..steps.len()).filter(|&at| is_sync(&steps[at])).collect()
}

/// Holds a service to what was promised before the power failed, results as they were `seen`;
/// gives those that it has once all is done, and what the webhook is to be told in all.
async fn hold(
    story: &Story,
    seen: &Results,
    rig: &Rig,
    promised: &Promised,
    place: &str,
) -> (Results, Heard) {
    // Jobs are numbered from 1; whoever comes after hears only of what is done again.
    let mut events = rig.client.events().await;
    let scans: relief_api::ScanList = rig.client.get(path::SCANS).await;
    // One that was cut short goes on.
    for scan in scans.scans.iter().filter(|scan| !scan.state.is_over()) {
        // As after every failure of the power, once a person has said so.
        let scan = settled(&rig.client, &scan.id).await;
        if !scan.state.is_over() {
            assert!(scan.needs_person, "{place}: {scan:?}");
            let _: Scan = rig.client.post(&path::scan_resume(&scan.id), &()).await;
        }
        ended(&mut events, &scan.id).await;
    }
    let scans: relief_api::ScanList = rig.client.get(path::SCANS).await;
    let jobs: relief_api::JobList = rig.client.get(path::JOBS).await;

    assert!(scans.scans.len() <= 1, "{place}");
    assert!(
        !promised.accepted || scans.scans.len() == 1,
        "{place}: the scan is lost"
    );
    let kept = columns(&rig.journal(&story.scan));
    assert!(
        kept.len() >= promised.columns,
        "{place}: {} of {} acknowledged columns are kept",
        kept.len(),
        promised.columns
    );
    assert_eq!(kept, story.columns[..kept.len()], "{place}");
    for scan in &scans.scans {
        assert!(scan.state.is_over(), "{place}: {scan:?}");
        assert!(scan.columns as usize == kept.len(), "{place}: {scan:?}");
        // Whatever was there when the power failed; of a scan without a journal nothing was.
        let begun = JournalReader::open(&rig.journal(&story.scan)).is_ok();
        assert!(begun || !promised.complete, "{place}");
        let expected = match begun {
            true => (ScanState::Complete, COLUMNS),
            false => (ScanState::Interrupted, 0),
        };
        assert_eq!((scan.state, scan.columns), expected, "{place}: {scan:?}");
        // A complete scan is processed, whenever it was that the power failed.
        assert_eq!(
            scan.state == ScanState::Complete,
            !scan.jobs.is_empty(),
            "{place}: {scan:?}"
        );
        let known: Vec<u64> = jobs.jobs.iter().rev().map(|job| job.id).collect();
        assert_eq!(scan.jobs, known, "{place}");
    }
    // The laser was on before there was a column.
    let log: LaserLog = rig.client.get(path::LASER).await;
    let was_on = log
        .entries
        .iter()
        .any(|entry| entry.laser == LaserState::On);
    assert!(was_on || promised.columns == 0, "{place}: {log:?}");
    if let Some(job) = promised.queued {
        assert!(jobs.jobs.iter().any(|j| j.id == job), "{place}: {jobs:?}");
    }

    let mut wanted = Heard::new();
    for scan in &scans.scans {
        wanted.insert((WebhookEvent::ScanEnded, scan.id.clone()));
    }
    let mut results = Results::new();
    for job in &jobs.jobs {
        wanted.insert((WebhookEvent::JobDone, job.id.to_string()));
        let is_promised = promised.published.contains(&job.result);
        if is_promised {
            assert_eq!(job.state, JobState::Done, "{place}: published twice");
        }
        let done = job_over(&mut events, rig, job.id).await;
        assert_eq!(done.state, JobState::Done, "{place}: {:?}", done.error);
        let folder = rig.daemon.spool_dir().join(&done.result);
        if promised.retired.contains(&done.result) && !folder.exists() {
            continue;
        }
        let now = files(&folder);
        check_whole(&now, place);
        if is_promised {
            assert!(now == seen[&done.result], "{place}: it was changed");
        }
        assert!(results.insert(done.result, now).is_none(), "{place}");
    }
    for result in promised.published.difference(&promised.retired) {
        assert!(results.contains_key(result), "{place}: {result} is gone");
    }
    let mut spooled: Vec<String> = fs::read_dir(rig.daemon.spool_dir())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    spooled.sort();
    assert!(spooled.iter().eq(results.keys()), "{place}: {spooled:?}");
    (results, wanted)
}

/// Every file that the manifest names is there, as long and with the bytes that it names.
fn check_whole(files: &BTreeMap<String, Vec<u8>>, place: &str) {
    let manifest: Manifest = serde_json::from_slice(&files["manifest.json"]).unwrap();
    assert_eq!(manifest.files.len() + 1, files.len(), "{place}");
    for file in &manifest.files {
        let hash = deliverables::sha256_of(files[&file.name].as_slice()).unwrap();
        assert_eq!(hash, file.sha256, "{place}: {}", file.name);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_promised_is_lost_wherever_the_power_fails() {
    let story = story().await;
    let syncs = syncs(&story.steps);
    assert!(syncs.len() > 40, "{} syncs", syncs.len());
    let mut dice = Dice::new(1);
    let mut images = 0;
    for &at in &syncs {
        // Before the sync took hold, and after it.
        revive(&story, at, Loss::All).await;
        revive(&story, at, Loss::Some(at as u64)).await;
        revive(&story, at + 1, Loss::All).await;
        images += 3;
    }
    let retired = |step: &Step| matches!(step, Step::Told(Told::Retired(_)));
    let retired = story.steps.iter().position(retired).unwrap();
    for seed in 0..20 {
        let rest = (story.steps.len() - retired) as u64;
        revive(
            &story,
            retired + dice.below(rest + 1) as usize,
            Loss::Some(seed),
        )
        .await;
        images += 1;
    }
    for seed in 0..60 {
        let at = dice.below(story.steps.len() as u64 + 1) as usize;
        revive(&story, at, Loss::Some(seed)).await;
        revive(&story, at, Loss::Nothing).await;
        images += 2;
    }
    println!(
        "{} steps, {} syncs, {images} media",
        story.steps.len(),
        syncs.len()
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_promised_is_lost_when_the_power_fails_again_during_the_recovery() {
    /// First failures, evenly over the story.
    const FIRST: usize = 6;
    let story = story().await;
    let syncs = syncs(&story.steps);
    let mut media = 0;
    for number in 0..FIRST {
        let at = syncs[(2 * number + 1) * syncs.len() / (2 * FIRST)];
        let loss = [Loss::All, Loss::Some(at as u64), Loss::Nothing][number % 3];
        media += revive_again(&story, at, loss).await;
    }
    println!("{media} media");
    assert!(media > 10 * FIRST, "{media} media");
}
