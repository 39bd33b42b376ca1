//! Records that are damaged are made anew from what is left of them, and from the journals.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use relief_api::{Job, JobList, JobState, Rerun, Scan, ScanList, ScanState, path};

use crate::rig::{Rig, job_over};

/// What happens to the file.
type Damage = (&'static str, fn(&mut Vec<u8>));

const DAMAGES: [Damage; 7] = [
    ("it is empty of sense", |bytes| bytes.fill(0x5a)),
    ("its head is gone", |bytes| bytes[..512].fill(0)),
    ("its head is torn", |bytes| bytes[64..320].fill(0xff)),
    ("it is cut off", |bytes| bytes.truncate(bytes.len() / 2)),
    ("it is cut to nothing", Vec::clear),
    ("its pages are mixed up", |bytes| {
        let half = bytes.len() / 2;
        bytes[4_096..half].reverse();
    }),
    ("every page has a wrong bit", |bytes| {
        for page in bytes.chunks_mut(4_096).skip(1) {
            page[1_000 % page.len()] ^= 4;
            page[40 % page.len()] ^= 1;
        }
    }),
];

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else if entry.file_type().unwrap().is_file() {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

fn times(spool: &Path) -> BTreeMap<String, std::time::SystemTime> {
    fs::read_dir(spool)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, entry.metadata().unwrap().modified().unwrap())
        })
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_records_lose_no_scan_and_no_result() {
    let rig = Rig::new().await;
    let (first, _) = rig.scan_to_result("first").await;
    let (second, _) = rig.scan_to_result("second").await;
    rig.daemon.shutdown().await;
    let records = fs::read(rig.folder.path().join("state/reliefd.redb")).unwrap();

    for (what, damage) in DAMAGES {
        let folder = tempfile::tempdir().unwrap();
        for part in ["state", "spool"] {
            copy(&rig.folder.path().join(part), &folder.path().join(part));
        }
        let state = folder.path().join("state");
        let mut bytes = records.clone();
        damage(&mut bytes);
        fs::write(state.join("reliefd.redb"), &bytes).unwrap();
        let before = times(&folder.path().join("spool"));

        let revived = Rig::start(folder, |_| {}).await;
        let scans: ScanList = revived.client.get(path::SCANS).await;
        let ids: Vec<&str> = scans.scans.iter().map(|scan| scan.id.as_str()).collect();
        assert_eq!(ids, [second.id.as_str(), first.id.as_str()], "{what}");
        for (scan, was) in scans.scans.iter().zip([&second, &first]) {
            assert_eq!(scan.state, ScanState::Complete, "{what}");
            assert_eq!((scan.columns, &scan.name), (was.columns, &was.name));
            assert_eq!(scan.jobs.len(), 1, "{what}");
        }
        let jobs: JobList = revived.client.get(path::JOBS).await;
        assert!(
            jobs.jobs.iter().all(|job| job.state == JobState::Done),
            "{what}: {jobs:?}"
        );
        assert_eq!(times(revived.daemon.spool_dir()), before, "{what}");
        // An empty file is taken for one that was just made; whatever else is kept.
        let aside = fs::read_dir(&state)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .find(|path| path.to_string_lossy().contains("damaged-"));
        match aside {
            Some(aside) => assert_eq!(fs::read(aside).unwrap().len(), bytes.len(), "{what}"),
            None => assert!(bytes.is_empty(), "{what}: the damage was not noticed"),
        }

        // And it goes on from there.
        let mut events = revived.client.events().await;
        let job: Job = revived
            .client
            .post(&path::scan_rerun(&first.id), &Rerun::default())
            .await;
        let job = job_over(&mut events, &revived, job.id).await;
        assert_eq!(job.state, JobState::Done, "{what}: {:?}", job.error);
        revived.daemon.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_journal_that_cannot_be_read_is_left_where_it_is() {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("a").await;
    let journal = rig.journal(&scan.id);
    rig.daemon.shutdown().await;
    let state = rig.folder.path().join("state");
    fs::remove_file(state.join("reliefd.redb")).unwrap();
    let stranger = state.join("scans/stranger.scan");
    fs::write(&stranger, "RELSCAN\nand then nothing of sense").unwrap();
    let rig = Rig::start(rig.folder, |_| {}).await;
    let scans: ScanList = rig.client.get(path::SCANS).await;
    let found: Vec<&Scan> = scans.scans.iter().collect();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].id, scan.id);
    assert!(stranger.exists() && journal.exists());
    rig.daemon.shutdown().await;
}
