//! Until when a scan has gone on by itself, for the next start of the service: the laser comes on
//! again without a person's word only if it was on a short while ago, and nobody has ended it.
//!
//! A small file beside the journal, written after each sync of columns. It is not synced: it
//! outlives the process and need not outlive the computer, since after a restart of that a person
//! is asked in any case. Times are those since the computer was started, sleep included; clocks
//! that are set, and the times of files, do not matter.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use crate::service::{lock, remove_if_there};

/// Names this run of the computer, where the service cannot see `/proc/sys`.
const BOOT_ID_VARIABLE: &str = "RELIEF_BOOT_ID";

const BOOT_ID_FILE: &str = "/proc/sys/kernel/random/boot_id";

/// The file of one scan.
#[derive(Debug)]
pub(crate) struct Presence {
    path: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug)]
enum State {
    /// It goes on by itself.
    Here(Option<File>),
    /// It stands still until a person has looked.
    Withdrawn,
    /// It has ended, or somebody has asked for its end.
    Ended,
}

impl Presence {
    /// That of a scan which has not begun; what an earlier run of the service left stays.
    pub(crate) fn new(path: PathBuf) -> Self {
        Self {
            path,
            state: Mutex::new(State::Here(None)),
        }
    }

    /// The scan goes on at this moment.
    pub(crate) fn beat(&self) {
        let mut state = lock(&self.state);
        let State::Here(file) = &mut *state else {
            return;
        };
        if let Err(error) = write(&self.path, file) {
            // The next start asks a person.
            tracing::debug!(file = %self.path.display(), %error, "cannot note that a scan goes on");
            remove_if_there(&self.path);
            *file = None;
        }
    }

    /// A person is asked.
    pub(crate) fn withdraw(&self) {
        self.change(State::Withdrawn);
    }

    /// A person has said that it may go on.
    pub(crate) fn restore(&self) {
        let mut state = lock(&self.state);
        if matches!(*state, State::Withdrawn) {
            *state = State::Here(None);
        }
    }

    /// The scan has ended, or is to end.
    pub(crate) fn end(&self) {
        self.change(State::Ended);
    }

    fn change(&self, to: State) {
        let mut state = lock(&self.state);
        remove_if_there(&self.path);
        if !matches!(*state, State::Ended) {
            *state = to;
        }
    }
}

fn write(path: &Path, file: &mut Option<File>) -> io::Result<()> {
    let Some(boot) = boot_id() else {
        return Err(io::Error::other("this run of the computer has no name"));
    };
    if file.is_none() {
        let options = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .open(path);
        *file = Some(options?);
    }
    let now = since_boot().as_nanos();
    match file {
        // Always as long, so that nothing of what was there before shows behind it.
        Some(file) => file.write_all_at(format!("{boot} {now:030}\n").as_bytes(), 0),
        None => Ok(()),
    }
}

/// When a scan last went on, by [`since_boot`]; `None` if that was in another run of the computer,
/// or a person was asked or has ended it since.
pub(crate) fn last_seen(path: &Path) -> Option<Duration> {
    let text = std::fs::read_to_string(path).ok()?;
    let (boot, at) = text.strip_suffix('\n')?.split_once(' ')?;
    let at = Duration::from_nanos(at.parse().ok()?);
    (boot_id()? == boot && at <= since_boot()).then_some(at)
}

/// Time since the computer was started, sleep included.
pub(crate) fn since_boot() -> Duration {
    let time = clock_gettime(ClockId::Boottime);
    // Neither is ever negative.
    Duration::new(
        time.tv_sec.try_into().unwrap_or_default(),
        time.tv_nsec.try_into().unwrap_or_default(),
    )
}

/// The name of this run of the computer, in hexadecimal.
fn boot_id() -> Option<String> {
    let told = std::env::var(BOOT_ID_VARIABLE).ok();
    let told = told.or_else(|| std::fs::read_to_string(BOOT_ID_FILE).ok())?;
    let id: String = told.trim().chars().filter(|&c| c != '-').collect();
    let is_one = id.len() == 32 && id.chars().all(|c| c.is_ascii_hexdigit());
    is_one.then_some(id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_there_while_the_scan_goes_on_by_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.presence");
        let presence = Presence::new(path.clone());
        assert_eq!(last_seen(&path), None);
        let before = since_boot();
        presence.beat();
        let first = last_seen(&path).unwrap();
        assert!(first >= before && first <= since_boot());
        presence.beat();
        assert!(last_seen(&path).unwrap() > first);
        // As another start of the service finds it, until it has a column itself.
        assert!(last_seen(&path).is_some());
        let next = Presence::new(path.clone());
        assert!(last_seen(&path).is_some());

        next.withdraw();
        next.beat();
        assert_eq!(last_seen(&path), None);
        next.restore();
        next.beat();
        assert!(last_seen(&path).is_some());
        next.end();
        assert!(!path.exists());
        next.restore();
        next.beat();
        next.withdraw();
        next.restore();
        next.beat();
        assert!(!path.exists());
    }

    #[test]
    fn another_run_of_the_computer_says_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.presence");
        Presence::new(path.clone()).beat();
        let text = std::fs::read_to_string(&path).unwrap();
        let (boot, at) = text.split_once(' ').unwrap();
        let later = format!("{boot} {}\n", since_boot().as_nanos() + 60_000_000_000);
        let other = format!("{} {at}", "0".repeat(32));
        for wrong in [&later, &other, boot, "", "\n", &text[..text.len() - 1]] {
            std::fs::write(&path, wrong).unwrap();
            assert_eq!(last_seen(&path), None, "{wrong}");
        }
        std::fs::write(&path, &text).unwrap();
        assert!(last_seen(&path).is_some());
    }
}
