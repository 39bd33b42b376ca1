//! State folders of earlier versions open. The files in `tests/golden` are never made anew:
//! ones like them are on users' disks.

use std::fs;
use std::io::Read as _;
use std::path::Path;

use flate2::read::GzDecoder;
use relief_api::{Job, JobList, JobState, Rerun, ScanList, ScanState, path};

use crate::rig::{Rig, job_over};

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
