//! State folders of earlier versions open. The files in `tests/golden` are never made anew:
//! ones like them are on users' disks.

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

use flate2::read::GzDecoder;
use relief_api::{
    DeliveryList, DeliveryState, Job, JobList, JobState, LaserLog, LaserState, Rerun, ScanList,
    ScanState, TokenList, path,
};
use tokio::net::TcpStream;

use crate::client::exchange;
use crate::rig::{Rig, job_over};
use crate::webhooks::receiver::Receiver;
use crate::webhooks::webhook;

/// Unpacks a state folder.
fn unpack(golden: &Path, state: &Path) {
    fs::create_dir_all(state.join("scans")).unwrap();
    for entry in fs::read_dir(golden).unwrap() {
        let packed = entry.unwrap().path();
        let Some(name) = packed
            .file_stem()
            .filter(|_| packed.extension().unwrap() == "gz")
        else {
            continue;
        };
        let target = match Path::new(name).extension() {
            Some(ending) if ending == "scan" => state.join("scans").join(name),
            _ => state.join(name),
        };
        let mut bytes = Vec::new();
        GzDecoder::new(fs::File::open(&packed).unwrap())
            .read_to_end(&mut bytes)
            .unwrap();
        fs::write(target, bytes).unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_state_of_version_1_opens() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/state-1");
    let read = |name: &str| fs::read(golden.join(name)).unwrap();
    let scans: ScanList = serde_json::from_slice(&read("scans.json")).unwrap();
    let jobs: JobList = serde_json::from_slice(&read("jobs.json")).unwrap();
    assert_eq!((scans.scans.len(), jobs.jobs.len()), (2, 2));

    let folder = tempfile::tempdir().unwrap();
    unpack(&golden, &folder.path().join("state"));
    let rig = Rig::start(folder, |_| {}).await;
    assert_eq!(rig.client.get::<ScanList>(path::SCANS).await, scans);
    assert_eq!(rig.client.get::<JobList>(path::JOBS).await, jobs);
    let whole = scans
        .scans
        .iter()
        .find(|scan| scan.state == ScanState::Complete)
        .unwrap();
    let mut events = rig.client.events().await;
    let job: Job = rig
        .client
        .post(&path::scan_rerun(&whole.id), &Rerun::default())
        .await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    assert_eq!(job.id, jobs.jobs.len() as u64 + 1);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn version_1_journals_alone_give_the_same_scans() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/state-1");
    let kept: ScanList =
        serde_json::from_slice(&fs::read(golden.join("scans.json")).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state");
    unpack(&golden, &state);
    fs::remove_file(state.join("reliefd.redb")).unwrap();
    let rig = Rig::start(folder, |_| {}).await;
    let found: ScanList = rig.client.get(path::SCANS).await;
    assert_eq!(found.scans.len(), kept.scans.len());
    for (found, kept) in found.scans.iter().zip(&kept.scans) {
        assert_eq!(
            (&found.id, &found.name, &found.part, &found.operator),
            (&kept.id, &kept.name, &kept.part, &kept.operator)
        );
        assert_eq!(
            (&found.note, found.state, &found.reason, found.columns),
            (&kept.note, kept.state, &kept.reason, kept.columns)
        );
        assert_eq!(
            (&found.settings, &found.started_at),
            (&kept.settings, &kept.started_at)
        );
    }
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_of_version_1_are_delivered_and_their_log_shown() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/webhooks-1");
    let read = |name: &str| fs::read(golden.join(name)).unwrap();
    let kept: DeliveryList = serde_json::from_slice(&read("deliveries.json")).unwrap();
    let waits = kept
        .deliveries
        .iter()
        .position(|delivery| delivery.state == DeliveryState::Waiting)
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    unpack(&golden, &folder.path().join("state"));
    let receiver = Receiver::new([]);
    let lab = webhook(folder.path(), "lab", &receiver.url());
    let rig = Rig::start(folder, |config| config.webhooks = vec![lab]).await;
    let got = receiver.next();
    assert_eq!(got.id(), kept.deliveries[waits].id);
    assert_eq!(got.body.as_bytes(), read("waiting.json"));
    let log = loop {
        let log: DeliveryList = rig.client.get(&path::webhook_deliveries("lab")).await;
        if log.deliveries[waits].state == DeliveryState::Delivered {
            break log;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    };
    for (index, (now, kept)) in log.deliveries.iter().zip(&kept.deliveries).enumerate() {
        if index == waits {
            assert_eq!((now.attempts, &now.tried[0]), (2, &kept.tried[0]));
        } else {
            assert_eq!(now, kept);
        }
    }
    assert_eq!(log.deliveries.len(), 3);
    rig.daemon.shutdown().await;
}

/// What `relief token create` has shown when the kept file was made.
const TOKEN: &str = "relief_8ef486a7e56fa6a8bf16a534bdfa4cfdadbba743b6e3a652315301f3237ff12a";

#[tokio::test(flavor = "multi_thread")]
async fn tokens_and_laser_logs_of_all_versions_hold() {
    for state in ["state-1", "state-2"] {
        tokens_and_laser_log_hold(state).await;
    }
}

async fn tokens_and_laser_log_hold(laser: &str) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state");
    fs::create_dir_all(&state).unwrap();
    for (of, name) in [("state-1", "tokens.json"), (laser, "laser.jsonl")] {
        fs::copy(golden.join(of).join(name), state.join(name)).unwrap();
    }
    let rig = Rig::start(folder, |config| {
        config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    })
    .await;
    let address = rig.daemon.listen().unwrap();
    let stream = TcpStream::connect(address).await.unwrap();
    let fields = format!("{address}\r\nAuthorization: Bearer {TOKEN}");
    let reply = exchange(stream, &fields, "GET", path::STATUS, None).await;
    assert_eq!(reply.status, 200);
    let tokens: TokenList = rig.client.get(path::TOKENS).await;
    assert_eq!(tokens.tokens[0].name, "bench");

    let log: LaserLog = rig.client.get(path::LASER).await;
    let kept: Vec<(&str, LaserState, Option<&str>)> = log
        .entries
        .iter()
        .map(|entry| (entry.cause.as_str(), entry.laser, entry.scan.as_deref()))
        .collect();
    let (house, gone) = (
        Some("20261122T203111.821Z-house"),
        Some("20261122T203113.345Z-gone"),
    );
    let before = [
        ("the scanner says that it is off", LaserState::Off, None),
        ("a scan begins", LaserState::On, house),
        ("the scan is complete", LaserState::Off, house),
        ("a scan begins", LaserState::On, gone),
        ("aborted on request", LaserState::Off, gone),
    ];
    assert_eq!(kept[..before.len()], before);
    rig.daemon.shutdown().await;
}
