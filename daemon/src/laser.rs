//! The laser: whether it is on, and a log of every change with its cause.
//!
//! Each scanner has a log in the state folder: one JSON object a line, only ever appended
//! to. A line that says `on` is on disk before the scanner is asked, if the disk takes it.

mod log;
mod names;
mod on_time;
mod watched;

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use relief_api::{Event, LaserEntry, LaserState, ScanState};
use scanner_driver::ScannerError;
use storage::Disk;

use crate::events::Hub;
use crate::ids::now;
use crate::service::lock;
use log::Log;
pub(crate) use names::end_other_logs;
use names::file_name;
use on_time::OnTime;
pub(crate) use watched::Watched;

/// Entries that are kept for showing; the file has all.
pub(crate) const MOST_SHOWN: usize = 1_000;

/// The log of the laser cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot use the log of the laser, {}: {source}; the folder service.state_dir must be \
     writable for the user of reliefd",
    path.display()
)]
pub struct LaserLogError {
    /// The file.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// What is known of the laser, and its log.
#[derive(Debug)]
pub(crate) struct Laser {
    known: Mutex<Known>,
}

#[derive(Debug)]
struct Known {
    scanner: String,
    log: Log,
    entries: VecDeque<LaserEntry>,
    on_time: OnTime,
    /// The scan that is about to begin.
    next_scan: Option<String>,
    /// The scan for whose sake the laser is on.
    scan: Option<String>,
    /// Why the scanner is about to be stopped.
    reason: Option<String>,
    /// Requests to stop that the scanner has not yet answered.
    stopping: u32,
    /// The scan ended while they were open.
    ended_meanwhile: bool,
    /// Counts what the service did, so that an answer to an older question is told.
    acts: u64,
    /// The scanner is being told to begin: what it answers meanwhile may be from before it does.
    starting: bool,
    /// Counts what may have turned it on, so that an answer to an older request to pause is told.
    lit: u64,
    /// Who is told of changes.
    hub: Option<Arc<Hub>>,
}

impl Laser {
    /// Opens a scanner's log in the state folder, and notes if the service last ended with the
    /// laser on.
    pub(crate) fn open(
        disk: &dyn Disk,
        state_dir: &Path,
        scanner: &str,
    ) -> Result<Self, LaserLogError> {
        let path = state_dir.join(file_name(scanner));
        let (log, mut entries) =
            Log::open(disk, &path).map_err(|source| LaserLogError { path, source })?;
        for entry in &mut entries {
            // Of a version in which scanners had no names.
            if entry.scanner.is_empty() {
                scanner.clone_into(&mut entry.scanner);
            }
        }
        let laser = Self {
            known: Mutex::new(Known {
                scanner: scanner.to_owned(),
                log,
                entries,
                on_time: OnTime::default(),
                next_scan: None,
                scan: None,
                reason: None,
                stopping: 0,
                ended_meanwhile: false,
                acts: 0,
                starting: false,
                lit: 0,
                hub: None,
            }),
        };
        if laser.state() == Some(LaserState::On) {
            laser.note(
                LaserState::Unknown,
                "the service ended while the laser was on; the scanner turns it off by itself \
                 when it hears nothing (dead-man time)",
            );
        }
        Ok(laser)
    }

    /// Has subscribers told of every change from now on.
    pub(crate) fn tell(&self, hub: Arc<Hub>) {
        lock(&self.known).hub = Some(hub);
    }

    /// The latest entry.
    pub(crate) fn latest(&self) -> Option<LaserEntry> {
        lock(&self.known).entries.back().cloned()
    }

    /// The latest entries, oldest first.
    pub(crate) fn entries(&self) -> Vec<LaserEntry> {
        lock(&self.known).entries.iter().cloned().collect()
    }

    /// How long the laser has been on since the service started.
    pub(crate) fn on_time(&self) -> Duration {
        lock(&self.known).on_time.total()
    }

    fn state(&self) -> Option<LaserState> {
        self.latest().map(|entry| entry.laser)
    }

    /// A scan is about to begin.
    pub(crate) fn scan_begins(&self, scan: &str) {
        lock(&self.known).next_scan = Some(scan.to_owned());
    }

    /// The scanner is about to be stopped for this reason.
    pub(crate) fn stop_asked(&self, reason: &str) {
        lock(&self.known).reason = Some(reason.to_owned());
    }

    /// The scan under way stands still: what the laser does is not known until the scanner
    /// says so, or measures again. Of a pause on request it may have said so already.
    pub(crate) fn scan_paused(&self, reason: &str) {
        let mut known = lock(&self.known);
        known.acts += 1;
        if !known.is(LaserState::Off) {
            known.note(LaserState::Unknown, reason);
        }
    }

    /// The scanner has closed the scan that somebody asked it to pause when this count was taken.
    fn closed_for_a_pause(&self, lit: u64) {
        let mut known = lock(&self.known);
        if known.lit == lit {
            known.acts += 1;
            known.note(LaserState::Off, "paused on request");
        }
    }

    /// The scan that stands still was told to go on: its last columns are measured again, and
    /// whether it does go on is seen then.
    fn told_to_go_on(&self) {
        let mut known = lock(&self.known);
        known.lit += 1;
        if !known.is_on() {
            known.add(LaserState::Unknown, "told to go on");
        }
    }

    /// The scan measures again.
    pub(crate) fn scan_goes_on(&self) {
        lock(&self.known).lit += 1;
        self.note(LaserState::On, "the scan goes on");
    }

    /// The scan under way has ended. A device that ended it by itself has turned the laser
    /// off; one that was lost, or has a fault, must be asked first.
    pub(crate) fn scan_ended(&self, state: ScanState, reason: Option<&str>) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.starting = false; // Where a defect kept the start from its end.
        known.next_scan = None;
        known.reason = None;
        if known.stopping > 0 {
            // The answer to the abort, which is on its way, says more.
            known.ended_meanwhile = true;
            return;
        }
        if known.is_on() {
            match state {
                ScanState::Complete => known.note(LaserState::Off, "the scan is complete"),
                _ => known.note(
                    LaserState::Unknown,
                    reason.unwrap_or("the scan ended early"),
                ),
            }
        }
        known.scan = None;
    }

    /// Notes what comes of what the service or its scan did.
    fn note(&self, laser: LaserState, cause: &str) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.note(laser, cause);
    }

    /// The same of what the scanner answered, unless the service has acted since it asked:
    /// an answer from before says nothing about what is now.
    fn note_answer(&self, acts: u64, laser: LaserState, cause: &str) {
        let mut known = lock(&self.known);
        if known.acts == acts && !known.starting {
            known.note(laser, cause);
        }
    }

    /// The scanner is about to be told to begin.
    fn begin(&self) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.starting = true;
        known.lit += 1;
        known.ended_meanwhile = false;
        known.scan = known.next_scan.take();
        known.note(LaserState::On, "a scan begins");
    }

    /// It has been told, and has begun unless there was an error.
    fn begun(&self, error: Option<&ScannerError>) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.starting = false;
        if let Some(error) = error {
            known.note(LaserState::Unknown, &error.to_string());
        }
    }

    /// A scan that was cut short is about to be taken up.
    fn take_up(&self) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.ended_meanwhile = false;
        known.scan = known.next_scan.take();
        known.add(
            LaserState::Unknown,
            "a scan is taken up that was cut short when the service last ended",
        );
    }

    /// The scanner is told to stop; why, if that is known.
    fn stopping(&self) -> Option<String> {
        let mut known = lock(&self.known);
        known.stopping += 1;
        known.reason.clone()
    }

    /// It has answered.
    fn stopped(&self, reason: Option<&str>, answer: &Result<(), ScannerError>) {
        let mut known = lock(&self.known);
        known.acts += 1;
        known.stopping -= 1;
        match answer {
            Ok(()) => known.note(
                LaserState::Off,
                reason.unwrap_or("the scanner was told to stop"),
            ),
            Err(error) if known.is_on() => known.note(LaserState::Unknown, &error.to_string()),
            Err(_) => {}
        }
        if known.stopping == 0 && std::mem::take(&mut known.ended_meanwhile) {
            known.scan = None;
        }
    }
}

impl Known {
    fn is(&self, laser: LaserState) -> bool {
        self.entries.back().is_some_and(|last| last.laser == laser)
    }

    fn is_on(&self) -> bool {
        self.is(LaserState::On)
    }

    /// Notes a state; one that is known already is not noted again.
    fn note(&mut self, laser: LaserState, cause: &str) {
        if self.entries.back().is_none_or(|last| last.laser != laser) {
            self.add(laser, cause);
        }
    }

    fn add(&mut self, laser: LaserState, cause: &str) {
        let entry = LaserEntry {
            at: now(),
            laser,
            cause: cause.to_owned(),
            scanner: self.scanner.clone(),
            scan: self.scan.clone(),
        };
        self.on_time.note(laser == LaserState::On);
        let (scanner, scan) = (&self.scanner, &entry.scan);
        match laser {
            LaserState::On => tracing::info!(scanner, cause, scan, "laser on"),
            LaserState::Off => tracing::info!(scanner, cause, scan, "laser off"),
            LaserState::Unknown => tracing::warn!(scanner, cause, scan, "laser unknown"),
        }
        if let Err(error) = self.log.append(&entry) {
            tracing::error!(
                %error,
                cause,
                "the log of the laser cannot be written now; its next line brings this one along"
            );
        }
        if let Some(hub) = &self.hub {
            hub.tell(Event::Laser(entry.clone()));
        }
        self.entries.push_back(entry);
        if self.entries.len() > MOST_SHOWN {
            self.entries.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs::OpenOptions;
    use std::io::Write;
    use std::sync::Arc;

    use scanner_driver::{DeviceStatus, ScanStream, Scanner};
    use scanner_protocol::{Identity, ScanPlan};
    use storage::LocalDisk;

    use relief_api::THE_SCANNER;

    use super::*;

    #[test]
    fn the_log_is_appended_to_and_survives_torn_lines() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("laser.jsonl");
        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        assert_eq!(laser.latest(), None);
        laser.scan_begins("s");
        laser.begin();
        laser.note(LaserState::On, "again");
        drop(laser);
        // As a crash in the middle of a line leaves it.
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        file.write_all(b"{\"at\":\"2026").unwrap();

        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        laser.note(LaserState::Off, "the scanner says that it is off");
        let states: Vec<LaserState> = laser.entries().iter().map(|e| e.laser).collect();
        let expected = [LaserState::On, LaserState::Unknown, LaserState::Off];
        assert_eq!(states, expected);
        assert_eq!(laser.entries()[0].scan.as_deref(), Some("s"));
        assert!(laser.entries()[1].cause.contains("dead-man"));
        let again = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        assert_eq!(again.entries(), laser.entries());
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 4, "{text}");
    }

    #[test]
    fn nobody_knows_of_a_pause_whether_the_laser_is_on() {
        let folder = tempfile::tempdir().unwrap();
        let laser = Laser::open(&LocalDisk, folder.path(), "left").unwrap();
        laser.scan_begins("s");
        laser.begin();
        laser.scan_paused("the cable was pulled");
        laser.scan_goes_on();
        laser.scan_ended(ScanState::Complete, None);
        let entries = laser.entries();
        let states: Vec<LaserState> = entries.iter().map(|e| e.laser).collect();
        use LaserState::{Off, On, Unknown};
        assert_eq!(states, [On, Unknown, On, Off]);
        assert!(entries.iter().all(|e| e.scan.as_deref() == Some("s")));
        assert_eq!(entries[1].cause, "the cable was pulled");
        assert!(entries.iter().all(|e| e.scanner == "left"));
    }

    #[test]
    fn logs_of_scanners_that_are_no_more_are_ended_and_others_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        for scanner in [THE_SCANNER, "left", "right"] {
            Laser::open(&LocalDisk, at, scanner).unwrap().begin();
        }
        std::fs::write(at.join("laser-notes.txt"), "mine").unwrap();
        let states = |scanner: &str| -> Vec<String> {
            let text = std::fs::read_to_string(at.join(file_name(scanner))).unwrap();
            let entries = text.lines().map(|line| serde_json::from_str(line).unwrap());
            entries
                .map(|e: LaserEntry| format!("{} {}", e.scanner, e.laser.as_str()))
                .collect()
        };
        end_other_logs(&LocalDisk, at, &["left"]);
        end_other_logs(&LocalDisk, at, &["left"]);
        assert_eq!(states("left"), ["left on"]);
        assert_eq!(states("right"), ["right on", "right unknown"]);
        assert_eq!(states(THE_SCANNER), ["scanner on", "scanner unknown"]);
        assert_eq!(std::fs::read_dir(at).unwrap().count(), 4);
    }

    #[test]
    fn entries_from_before_scanners_had_names_are_of_the_one_there_was() {
        let folder = tempfile::tempdir().unwrap();
        let old = r#"{"at":"2026-11-22T11:11:36.320Z","laser":"off","cause":"c","scan":"s"}"#;
        std::fs::write(folder.path().join("laser.jsonl"), format!("{old}\n")).unwrap();
        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        assert_eq!(laser.entries()[0].scanner, "scanner");
        assert_eq!(laser.entries()[0].scan.as_deref(), Some("s"));
    }

    /// A scanner that says this to whoever pauses or resumes, and whose scan ends before it answers an
    /// abort.
    struct Said(Result<(), ScannerError>, Arc<Laser>);

    impl Scanner for Said {
        fn identify(&self) -> Result<Identity, ScannerError> {
            Err(ScannerError::Closed)
        }

        fn home(&self) -> Result<(), ScannerError> {
            Err(ScannerError::Closed)
        }

        fn status(&self) -> Result<DeviceStatus, ScannerError> {
            Err(ScannerError::Closed)
        }

        fn start_scan(&self, _plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
            Err(ScannerError::Closed)
        }

        fn resume_scan(&self) -> Result<(), ScannerError> {
            self.0.clone()
        }

        fn pause_scan(&self) -> Result<(), ScannerError> {
            self.0.clone()
        }

        fn abort(&self) -> Result<(), ScannerError> {
            self.1.scan_ended(ScanState::Aborted, Some("aborted"));
            Ok(())
        }
    }

    fn states(laser: &Laser) -> Vec<LaserState> {
        laser.entries().iter().map(|entry| entry.laser).collect()
    }

    #[test]
    fn a_scan_told_to_go_on_is_not_on_before_it_does() {
        use LaserState::{On, Unknown};
        let folder = tempfile::tempdir().unwrap();
        let laser = Arc::new(Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap());
        let watched =
            |said| Watched::new(Arc::new(Said(said, Arc::clone(&laser))), Arc::clone(&laser));
        laser.scan_begins("s");
        laser.begin();
        laser.scan_paused("the door is open");
        watched(Err(ScannerError::NothingPaused))
            .resume_scan()
            .unwrap_err();
        assert_eq!(states(&laser), [On, Unknown]);
        watched(Ok(())).resume_scan().unwrap();
        assert_eq!(states(&laser), [On, Unknown, Unknown]);
        assert_eq!(laser.latest().unwrap().cause, "told to go on");
        laser.scan_goes_on();
        // It may have gone on before that is noted.
        watched(Ok(())).resume_scan().unwrap();
        assert_eq!(states(&laser), [On, Unknown, Unknown, On]);
    }

    #[test]
    fn a_laser_is_off_in_a_pause_if_the_scanner_has_said_so() {
        use LaserState::{Off, On, Unknown};
        let paused = |said, told_first: bool| {
            let folder = tempfile::tempdir().unwrap();
            let laser = Arc::new(Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap());
            let watched =
                Watched::new(Arc::new(Said(said, Arc::clone(&laser))), Arc::clone(&laser));
            laser.begin();
            if told_first {
                laser.scan_paused("paused on request");
            }
            let _ = watched.pause_scan();
            if !told_first {
                laser.scan_paused("paused on request");
            }
            laser.scan_goes_on();
            states(&laser)
        };
        assert_eq!(paused(Ok(()), false), [On, Off, On]);
        assert_eq!(paused(Ok(()), true), [On, Unknown, Off, On]);
        let unheard = || Err(ScannerError::DeadMan);
        assert_eq!(paused(unheard(), false), [On, Unknown, On]);
        // What was told to go on meanwhile may have done so.
        let folder = tempfile::tempdir().unwrap();
        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        laser.begin();
        let lit = lock(&laser.known).lit;
        laser.scan_paused("paused on request");
        laser.told_to_go_on();
        laser.closed_for_a_pause(lit);
        assert_eq!(states(&laser), [On, Unknown, Unknown]);
    }

    #[test]
    fn an_abort_is_noted_once_and_with_its_scan() {
        let folder = tempfile::tempdir().unwrap();
        let laser = Arc::new(Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap());
        let said = Said(Ok(()), Arc::clone(&laser));
        let watched = Watched::new(Arc::new(said), Arc::clone(&laser));
        laser.scan_begins("s");
        laser.begin();
        laser.stop_asked("aborted on request");
        watched.abort().unwrap();
        assert_eq!(states(&laser), [LaserState::On, LaserState::Off]);
        let off = laser.latest().unwrap();
        assert_eq!(
            (off.cause.as_str(), off.scan.as_deref()),
            ("aborted on request", Some("s"))
        );
        laser.note(LaserState::On, "the scanner says that it is on");
        assert_eq!(laser.latest().unwrap().scan, None);
    }

    #[test]
    fn an_answer_to_an_older_question_does_not_count() {
        use LaserState::{Off, On, Unknown};
        let folder = tempfile::tempdir().unwrap();
        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        let acts = || lock(&laser.known).acts;
        let off = |asked| laser.note_answer(asked, Off, "the scanner says that it is off");
        laser.begin();
        let asked = acts(); // While it begins.
        off(asked);
        laser.begun(None);
        off(asked);
        let asked = acts();
        laser.scan_paused("the cable was pulled");
        off(asked);
        let asked = acts();
        laser.scan_goes_on();
        off(asked);
        let asked = acts();
        laser.scan_ended(ScanState::Failed, None);
        off(asked);
        assert_eq!(states(&laser), [On, Unknown, On, Unknown]);
        off(acts());
        assert_eq!(states(&laser).last(), Some(&Off));
    }

    #[test]
    fn only_the_latest_entries_are_kept_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("laser.jsonl");
        let entry = |number: u32| LaserEntry {
            at: number.to_string(),
            laser: LaserState::Off,
            cause: "c".repeat(100),
            scanner: THE_SCANNER.into(),
            scan: None,
        };
        let text: String = (0..9_000)
            .map(|n| serde_json::to_string(&entry(n)).unwrap() + "\n")
            .collect();
        std::fs::write(&path, text).unwrap();
        let laser = Laser::open(&LocalDisk, folder.path(), THE_SCANNER).unwrap();
        assert_eq!(laser.entries().len(), MOST_SHOWN);
        assert_eq!(laser.latest(), Some(entry(8_999)));
    }
}
