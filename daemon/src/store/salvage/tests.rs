use std::io;
use std::sync::Arc;

use serde_json::{Value, json};
use storage::{Deed, HinderedDisk, Hindrance, LocalDisk};

use super::*;
use crate::store::Store;
use crate::store::record::encode;

const SCANS_KEPT: usize = 300;
const JOBS_KEPT: usize = 90;
const MESSAGES_KEPT: u64 = 20;
const TIME: &str = "2026-11-21T11:08:30.123Z";

/// Records that no journal could tell: columns that are gone, jobs that were cancelled or failed,
/// reruns.
fn scan(number: usize) -> Scan {
    let mut scan = json!({
        "id": format!("scan-{number:03}"),
        "name": format!("part {number}"),
        "state": "complete",
        "started_at": TIME,
        "ended_at": TIME,
        "columns": number,
        "jobs": [number + 1],
    });
    if number.is_multiple_of(3) {
        scan["removed_at"] = TIME.into();
    }
    serde_json::from_value(scan).unwrap()
}

fn job(number: usize) -> Job {
    let state = ["done", "cancelled", "failed"][number % 3];
    let job: Value = json!({
        "id": number + 1,
        "scan": format!("scan-{:03}", number / 2),
        "result": format!("result-{number}"),
        "name": "again",
        "state": state,
        "attempts": 2,
        "queued_at": TIME,
        "timings": [],
        "settings": { "reconstruct.tolerance_mm": 0.1 },
    });
    serde_json::from_value(job).unwrap()
}

fn message(number: u64) -> Message {
    let message = json!({
        "delivery": {
            "id": format!("msg_{number}"),
            "event": "job-done",
            "state": "waiting",
            "created_at": TIME,
            "attempts": 0,
            "tried": [],
        },
        "body": format!("{number}"),
    });
    serde_json::from_value(message).unwrap()
}

/// Makes the records, and closes them in good order; the file's bytes.
fn make(path: &Path) -> Vec<u8> {
    let database = open_database(&LocalDisk, path).unwrap();
    let transaction = database.begin_write().unwrap();
    {
        let mut scans = transaction.open_table(SCANS).unwrap();
        for number in 0..SCANS_KEPT {
            let scan = scan(number);
            scans.insert(&*scan.id, &*encode(&scan)).unwrap();
        }
        let mut jobs = transaction.open_table(JOBS).unwrap();
        for number in 0..JOBS_KEPT {
            let job = job(number);
            jobs.insert(job.id, &*encode(&job)).unwrap();
        }
        let mut waiting = transaction.open_table(WAITING).unwrap();
        let mut log = transaction.open_table(LOG).unwrap();
        for number in 0..MESSAGES_KEPT {
            let message = message(number);
            waiting.insert(("lab", number), &*encode(&message)).unwrap();
            log.insert(("lab", number), &*encode(&message.delivery))
                .unwrap();
        }
    }
    transaction.commit().unwrap();
    database.close().unwrap();
    fs::read(path).unwrap()
}

fn places(bytes: &[u8], text: &str) -> Vec<usize> {
    let places: Vec<usize> = (0..bytes.len())
        .filter(|&at| bytes[at..].starts_with(text.as_bytes()))
        .collect();
    assert!(!places.is_empty(), "{text}");
    places
}

fn open(path: &Path) -> Result<Store, StoreError> {
    Store::open(Arc::new(LocalDisk), path)
}

/// The numbers of the scans that are kept, each as it was.
fn kept_scans(store: &Store) -> Vec<usize> {
    let all: Vec<Scan> = (0..SCANS_KEPT).map(scan).collect();
    let number = |kept: &Scan| all.iter().position(|scan| scan == kept).unwrap();
    store.scans().unwrap().iter().map(number).collect()
}

fn all_jobs() -> Vec<Job> {
    (0..JOBS_KEPT).map(job).collect()
}

/// Makes records of which that of one scan is damaged.
fn make_damaged(path: &Path) {
    let mut bytes = make(path);
    for at in places(&bytes, r#""record":{"id":"scan-150""#) {
        bytes[at] = b'x';
    }
    fs::write(path, bytes).unwrap();
}

#[test]
fn one_damaged_record_costs_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.redb");
    make_damaged(&path);
    let store = open(&path).unwrap();
    let expected: Vec<usize> = (0..SCANS_KEPT).filter(|&number| number != 150).collect();
    assert_eq!(kept_scans(&store), expected);
    assert_eq!(store.jobs().unwrap(), all_jobs());
    let numbers: Vec<u64> = (0..MESSAGES_KEPT).collect();
    assert_eq!(store.waiting("lab").unwrap(), numbers);
    for number in numbers {
        let kept = store.message("lab", number).unwrap();
        assert_eq!(kept, Some(message(number)));
    }
    assert_eq!(
        store.deliveries("lab").unwrap().len(),
        2 * MESSAGES_KEPT as usize
    );
}

#[test]
fn a_damaged_message_costs_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.redb");
    let mut bytes = make(&path);
    for at in places(&bytes, r#""id":"msg_7""#) {
        bytes[at] = b'x';
    }
    fs::write(&path, bytes).unwrap();
    let store = open(&path).unwrap();
    let numbers: Vec<u64> = (0..MESSAGES_KEPT).filter(|&number| number != 7).collect();
    assert_eq!(store.waiting("lab").unwrap(), numbers);
    assert_eq!(store.jobs().unwrap(), all_jobs());
    assert_eq!(kept_scans(&store).len(), SCANS_KEPT);
}

#[test]
fn damaged_records_of_a_version_without_webhooks_lose_nothing_more() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.redb");
    let file = Database::create(&path).unwrap();
    let transaction = file.begin_write().unwrap();
    transaction.open_table(SCANS).unwrap();
    transaction.open_table(JOBS).unwrap();
    transaction.commit().unwrap();
    assert_eq!(Rows::read(&file).lost, [] as [&str; 0]);
}

#[test]
fn a_page_that_cannot_be_read_costs_what_is_on_it() {
    const PAGE_BYTES: usize = 4_096;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.redb");
    let mut bytes = make(&path);
    let mut lost = vec![];
    for at in places(&bytes, r#""record":{"id":"scan-150""#) {
        let page = at - at % PAGE_BYTES;
        let held = &bytes[page..page + PAGE_BYTES];
        let holds = |number: &usize| {
            let text = format!(r#""record":{{"id":"scan-{number:03}""#);
            held.windows(text.len())
                .any(|window| window == text.as_bytes())
        };
        lost.extend((0..SCANS_KEPT).filter(holds));
        bytes[page..page + 16].fill(0xff);
    }
    assert!(lost.len() < 40, "{lost:?}");
    fs::write(&path, bytes).unwrap();
    let store = open(&path).unwrap();
    let expected: Vec<usize> = (0..SCANS_KEPT).filter(|n| !lost.contains(n)).collect();
    assert_eq!(kept_scans(&store), expected);
    assert_eq!(store.jobs().unwrap(), all_jobs());
}

/// Refuses to give a file this name, as if the power failed before.
#[derive(Debug, Clone)]
struct Refusing(PathBuf);

impl Hindrance for Refusing {
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()> {
        if deed == Deed::Rename && path == self.0 {
            return Err(io::ErrorKind::Interrupted.into());
        }
        Ok(())
    }
}

#[test]
fn what_was_read_of_damaged_records_survives_a_start_that_is_cut_short() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.redb");
    make_damaged(&path);
    Store::open(Arc::new(HinderedDisk(Refusing(path.clone()))), &path).unwrap_err();
    assert!(!path.exists(), "it was cut short elsewhere");
    let store = open(&path).unwrap();
    assert_eq!(kept_scans(&store).len(), SCANS_KEPT - 1);
    assert_eq!(store.jobs().unwrap(), all_jobs());
    let files = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 3, "the records, their lock, and the damaged ones");
}
