//! The service dies in the midst of a scan, and is started on what it left.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use relief_api::{Event, Scan, ScanState, Status, path};
use reliefd::Config;
use scan_record::{JournalReader, RawColumn};
use storage::LocalDisk;
use tempfile::TempDir;

use crate::fake::{COLUMNS, FakeScanner};
use crate::rig::{GUARD, Rig, ended, job_over, settled};

/// Columns that are kept when it dies.
const KEPT: u32 = 10;

/// A service in the midst of a scan that stands still.
async fn amid() -> (Rig, Scan) {
    let rig = Rig::new().await;
    rig.scanner.allow(KEPT);
    let scan = rig.start_scan("cut").await;
    let kept = async {
        while active(&rig).await.is_none_or(|scan| scan.columns < KEPT) {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let kept = tokio::time::timeout(GUARD, kept).await;
    kept.expect("columns are kept");
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
    let over = match settled(&rig.client, &scan.id).await {
        // It is shown as over a moment before it is kept, with its job, and that is told.
        scan if scan.state.is_over() && !scan.jobs.is_empty() => scan,
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
    let folder = left_by(&first);
    let presence = folder.path().join(presence_of(&scan));
    let text = fs::read_to_string(&presence).unwrap();
    let (boot, at) = text.trim().split_once(' ').unwrap();
    let at: u64 = at.parse().unwrap();
    // A computer that was only just started has no longer past.
    let silent = at.min(20 * 60 * 1_000_000_000);
    fs::write(&presence, format!("{boot} {:030}\n", at - silent)).unwrap();
    let silent = Duration::from_nanos(silent);
    let rig = start_still(folder).await;
    settled(&rig.client, &scan.id).await;
    let [taken_up] = rig.scanner.taken_up().try_into().unwrap();
    assert!(taken_up.silent >= silent, "{:?}", taken_up.silent);
    // Taking it up is no sign of life.
    let again = start_still(left_by(&rig)).await;
    settled(&again.client, &scan.id).await;
    let [taken_up] = again.scanner.taken_up().try_into().unwrap();
    assert!(taken_up.silent >= silent, "{:?}", taken_up.silent);
    assert_eq!(taken_up.waits_for, None);
    again.daemon.shutdown().await;
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

fn presence_of(scan: &Scan) -> String {
    format!("state/scans/{}.presence", scan.id)
}

/// The computer was started anew, so that nobody may expect the laser.
#[tokio::test(flavor = "multi_thread")]
async fn after_a_restart_of_the_computer_a_person_is_asked() {
    let (first, scan) = amid().await;
    let folder = left_by(&first);
    let presence = folder.path().join(presence_of(&scan));
    let text = fs::read_to_string(&presence).unwrap();
    let (_, at) = text.split_once(' ').unwrap();
    fs::write(&presence, format!("{} {at}", "0".repeat(32))).unwrap();
    let rig = Rig::start(folder, |_| {}).await;
    let paused = settled(&rig.client, &scan.id).await;
    assert_eq!(
        (paused.state, paused.needs_person),
        (ScanState::Paused, true)
    );
    let reason = paused.reason.unwrap();
    assert!(reason.contains("started anew"), "{reason}");
    let mut events = rig.client.events().await;
    let _: Scan = rig.client.post(&path::scan_resume(&scan.id), &()).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

/// Somebody had paused it, and has not said yet that it may go on.
#[tokio::test(flavor = "multi_thread")]
async fn a_scan_paused_on_request_waits_after_the_service_died_as_well() {
    let (first, scan) = amid().await;
    let mut events = first.client.events().await;
    let _: Scan = first.client.ask(&path::scan_pause(&scan.id)).await;
    // Told once it is kept, and paused a little before.
    let paused = |event: &Event| match event {
        Event::Scan(scan) => (scan.state == ScanState::Paused).then_some(()),
        _ => None,
    };
    events.until(paused).await;
    let rig = Rig::start(left_by(&first), |_| {}).await;
    let paused = settled(&rig.client, &scan.id).await;
    assert_eq!(
        (paused.state, paused.needs_person),
        (ScanState::Paused, true)
    );
    let reason = paused.reason.unwrap();
    let words = "before that: paused on request; `relief resume` lets it go on";
    assert!(reason.ends_with(words), "{reason}");
    let mut events = rig.client.events().await;
    let _: Scan = rig.client.ask(&path::scan_resume(&scan.id)).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

/// The service dies while it still writes down that the scan was ended.
#[tokio::test(flavor = "multi_thread")]
async fn a_scan_that_somebody_has_ended_does_not_go_on_by_itself() {
    let (first, scan) = amid().await;
    let before = left_by(&first);
    let _: Scan = first.client.post(&path::scan_abort(&scan.id), &()).await;
    // Once the abort is answered, what it stands on is gone, whatever else has been written.
    assert!(!first.folder.path().join(presence_of(&scan)).exists());
    fs::remove_file(before.path().join(presence_of(&scan))).unwrap();
    let rig = Rig::start(before, |_| {}).await;
    let paused = settled(&rig.client, &scan.id).await;
    assert_eq!(
        (paused.state, paused.needs_person),
        (ScanState::Paused, true)
    );
    let mut events = rig.client.events().await;
    let _: Scan = rig.client.post(&path::scan_abort(&scan.id), &()).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Aborted, KEPT));
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

/// The abort finds no scan in the driver yet.
#[tokio::test(flavor = "multi_thread")]
async fn an_abort_while_a_scan_is_taken_up_holds() {
    let (first, scan) = amid().await;
    let (told, asked) = mpsc::channel();
    let (go, wait) = mpsc::channel::<()>();
    let held = Mutex::new(Some((told, wait)));
    let hold = move |scanner: &FakeScanner| {
        let (told, wait) = held.lock().unwrap().take().expect("one scanner");
        scanner.on_start(move || {
            told.send(()).unwrap();
            // Also if the test has failed meanwhile.
            let _ = wait.recv_timeout(GUARD);
        });
    };
    let disk = Arc::new(LocalDisk);
    let rig = Rig::start_before(left_by(&first), disk, |_| {}, hold).await;
    let mut events = rig.client.events().await;
    let asked = tokio::task::spawn_blocking(move || asked.recv_timeout(GUARD));
    asked.await.unwrap().expect("the scan is taken up");
    let _: Scan = rig.client.post(&path::scan_abort(&scan.id), &()).await;
    go.send(()).unwrap();
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Aborted, KEPT));
    rig.scanner.laser_goes_off();
    assert_eq!(columns(&rig.journal(&scan.id)).len() as u32, KEPT);
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_goes_on_after_the_service_died_only_where_it_may() {
    let (mut rig, scan) = amid().await;
    for times in 1..=3 {
        let next = left_by(&rig);
        rig.daemon.shutdown().await;
        rig = start_still(next).await;
        let paused = settled(&rig.client, &scan.id).await;
        let interruption = paused.interruption.clone().unwrap();
        assert_eq!((interruption.times, interruption.columns), (times, KEPT));
        // The live range image may be what ends it.
        let grid = format!("state/scans/{}.grid", scan.id);
        assert_eq!(rig.folder.path().join(grid).exists(), times < 3);
        if times < 3 {
            assert!(!paused.needs_person, "{paused:?}");
        } else {
            assert_eq!(
                (paused.state, paused.needs_person),
                (ScanState::Paused, true)
            );
            let reason = paused.reason.unwrap();
            assert!(reason.contains("3 times in a row"), "{reason}");
            assert!(reason.contains("relief resume"), "{reason}");
        }
    }
    rig.scanner.allow_all();
    let mut events = rig.client.events().await;
    let _: Scan = rig.client.post(&path::scan_resume(&scan.id), &()).await;
    let over = ended(&mut events, &scan.id).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    // No live range image was made of a part of it.
    let job = job_over(&mut events, &rig, over.jobs[0]).await;
    let other = Rig::new().await;
    let (undisturbed, _) = other.scan_to_result("cut").await;
    let picture = |rig: &Rig, result: &str| {
        fs::read(rig.daemon.spool_dir().join(result).join("range.png")).unwrap()
    };
    assert!(picture(&rig, &job.result) == picture(&other, &undisturbed.id));
    other.daemon.shutdown().await;
    rig.daemon.shutdown().await;
}

/// All columns are there, and the service died before the journal got its end.
#[tokio::test(flavor = "multi_thread")]
async fn a_scan_with_all_its_columns_is_complete_without_scanner_or_person() {
    let (first, scan) = amid().await;
    let folder = left_by(&first);
    first.scanner.allow_all();
    let mut events = first.client.events().await;
    if active(&first).await.is_some() {
        ended(&mut events, &scan.id).await;
    }
    let whole = fs::read(first.journal(&scan.id)).unwrap();
    // An end record is a kind, a length, a cause, a count and a checksum.
    let cut = &whole[..whole.len() - (1 + 4 + 1 + 4 + 4)];
    let journal = folder.path().join(format!("state/scans/{}.scan", scan.id));
    fs::write(journal, cut).unwrap();
    let rig = Rig::start(folder, |config| config.scanner.resume = false).await;
    let over: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert_eq!((over.state, over.columns), (ScanState::Complete, COLUMNS));
    assert_eq!(over.jobs.len(), 1);
    assert!(rig.scanner.taken_up().is_empty());
    assert!(fs::read(rig.journal(&scan.id)).unwrap() == whole);
    rig.daemon.shutdown().await;
    first.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_go_on_is_kept_and_says_why() {
    let (first, scan) = amid().await;
    let journal = format!("state/scans/{}.scan", scan.id);
    let interrupted = async |folder: TempDir, words: &str, change: fn(&mut Config)| {
        let before = fs::read(folder.path().join(&journal)).unwrap();
        let rig = Rig::start(folder, change).await;
        let over = settled(&rig.client, &scan.id).await;
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
