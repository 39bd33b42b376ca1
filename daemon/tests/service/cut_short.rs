//! The service dies in the midst of a scan, and is started on what it left.

use std::fs::{self, File, FileTimes};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use relief_api::{Scan, ScanState, Status, path};
use reliefd::Config;
use scan_record::{JournalReader, RawColumn};
use storage::LocalDisk;
use tempfile::TempDir;

use crate::fake::{COLUMNS, FakeScanner};
use crate::rig::{Rig, ended};

/// Columns that are kept when it dies.
const KEPT: u32 = 10;

/// A service in the midst of a scan that stands still.
async fn amid() -> (Rig, Scan) {
    let rig = Rig::new().await;
    rig.scanner.allow(KEPT);
    let scan = rig.start_scan("cut").await;
    while active(&rig).await.is_none_or(|scan| scan.columns < KEPT) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    (rig, scan)
}

/// What it leaves if it dies now.
fn left_by(rig: &Rig) -> TempDir {
    fn copy(from: &Path, to: &Path) {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            let to = to.join(entry.file_name());
            if entry.file_type().unwrap().is_dir() {
                copy(&entry.path(), &to);
            } else if entry.file_type().unwrap().is_file() {
                fs::copy(entry.path(), to).unwrap();
            }
        }
    }
    let folder = tempfile::tempdir().unwrap();
    copy(
        &rig.folder.path().join("state"),
        &folder.path().join("state"),
    );
    folder
}

async fn active(rig: &Rig) -> Option<Scan> {
    let status: Status = rig.client.get(path::STATUS).await;
    status.scan
}

/// The scan once its state is no longer `starting`.
async fn settled(rig: &Rig, id: &str) -> Scan {
    loop {
        let scan: Scan = rig.client.get(&path::scan(id)).await;
        if scan.state != ScanState::Starting {
            return scan;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

fn columns(journal: &Path) -> Vec<RawColumn> {
    let mut reader = JournalReader::open(journal).unwrap();
    std::iter::from_fn(|| reader.next_column().unwrap()).collect()
}

/// A service that gets no column more.
async fn start_still(folder: TempDir) -> Rig {
    let still = |scanner: &FakeScanner| scanner.allow(0);
    Rig::start_before(folder, Arc::new(LocalDisk), |_| {}, still).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_cut_short_goes_on_and_is_as_if_nothing_had_happened() {
    let (first, scan) = amid().await;
    let rig = Rig::start(left_by(&first), |_| {}).await;
    let mut events = rig.client.events().await;
    let over = match settled(&rig, &scan.id).await {
        scan if scan.state.is_over() => scan,
        scan => ended(&mut events, &scan.id).await,
    };
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    let interruption = over.interruption.unwrap();
    assert_eq!((interruption.columns, interruption.times), (KEPT, 1));
    assert_eq!(over.jobs.len(), 1);
    first.scanner.allow_all();
    let mut events = first.client.events().await;
    if active(&first).await.is_some() {
        ended(&mut events, &scan.id).await;
    }
    let undisturbed = columns(&first.journal(&scan.id));
    assert_eq!(undisturbed.len() as u32, COLUMNS);
    assert_eq!(columns(&rig.journal(&scan.id)), undisturbed);
    let [taken_up] = rig.scanner.taken_up().try_into().unwrap();
    assert_eq!((taken_up.columns(), &taken_up.waits_for), (KEPT, &None));
    first.daemon.shutdown().await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_silence_is_counted_from_the_last_column() {
    let (first, scan) = amid().await;
    let minute = Duration::from_secs(60);
    let now = SystemTime::now();
    let ahead = Duration::MAX;
    let cases = [(now - 20 * minute, 20 * minute), (now + 20 * minute, ahead)];
    for (written, silent) in cases {
        let folder = left_by(&first);
        let journal = folder.path().join(format!("state/scans/{}.scan", scan.id));
        let times = FileTimes::new().set_modified(written);
        let file = File::options().append(true).open(journal).unwrap();
        file.set_times(times).unwrap();
        let rig = start_still(folder).await;
        settled(&rig, &scan.id).await;
        let [taken_up] = rig.scanner.taken_up().try_into().unwrap();
        assert!(taken_up.silent >= silent, "{:?}", taken_up.silent);
        // Taking it up has written to the journal, and is no sign of life.
        let again = start_still(left_by(&rig)).await;
        settled(&again, &scan.id).await;
        let [taken_up] = again.scanner.taken_up().try_into().unwrap();
        assert!(taken_up.silent >= silent, "{:?}", taken_up.silent);
        again.daemon.shutdown().await;
        rig.daemon.shutdown().await;
    }
    first.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_goes_on_after_the_service_died_only_where_it_may() {
    let (mut rig, scan) = amid().await;
    for times in 1..=4 {
        let next = left_by(&rig);
        rig.daemon.shutdown().await;
        rig = start_still(next).await;
        let paused = settled(&rig, &scan.id).await;
        let interruption = paused.interruption.clone().unwrap();
        assert_eq!((interruption.times, interruption.columns), (times, KEPT));
        if times < 4 {
            assert!(!paused.needs_person, "{paused:?}");
        } else {
            assert_eq!(
                (paused.state, paused.needs_person),
                (ScanState::Paused, true)
            );
            let reason = paused.reason.unwrap();
            assert!(reason.contains("4 times in a row"), "{reason}");
            assert!(reason.contains("relief resume"), "{reason}");
        }
    }
    rig.scanner.allow_all();
    let mut events = rig.client.events().await;
    let _: Scan = rig.client.post(&path::scan_resume(&scan.id), &()).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_go_on_is_kept_and_says_why() {
    let (first, scan) = amid().await;
    let journal = format!("state/scans/{}.scan", scan.id);
    let interrupted = async |folder: TempDir, words: &str, change: fn(&mut Config)| {
        let before = fs::read(folder.path().join(&journal)).unwrap();
        let rig = Rig::start(folder, change).await;
        let over = settled(&rig, &scan.id).await;
        assert_eq!((over.state, over.columns), (ScanState::Interrupted, KEPT));
        let reason = over.reason.unwrap();
        assert!(reason.contains(words), "{reason}");
        assert!(rig.scanner.taken_up().is_empty());
        assert!(fs::read(rig.journal(&scan.id)).unwrap() == before);
        rig.daemon.shutdown().await;
    };
    interrupted(left_by(&first), "resume is false", |config| {
        config.scanner.resume = false;
    })
    .await;
    let damaged = left_by(&first);
    let path = damaged.path().join(&journal);
    let mut file = File::options().append(true).open(path).unwrap();
    file.write_all(&vec![7; 4 << 20]).unwrap();
    interrupted(damaged, "damaged long before its end", |_| {}).await;
    let no_room = |config: &mut Config| config.storage.reserve_mb = u32::MAX;
    interrupted(left_by(&first), "free", no_room).await;
    first.daemon.shutdown().await;
}
