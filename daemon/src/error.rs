//! Why the service refuses something.

use std::io;

use relief_api::{JobId, JobState, ScanState, THE_SCANNER};
use scanner_driver::ScannerError;

use crate::acquisition::PlanError;
use crate::calibration::CalibrationError;
use crate::config::OverrideError;
use crate::spool::SpoolError;
use crate::station::Station;
use crate::store::StoreError;
use crate::tokens::TokenError;

/// Why the service refuses a request.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// It is about to end.
    #[error("the service is stopping")]
    Stopping,
    /// It is there for something else.
    #[error("this service takes no scans: its roles ([service] roles) are without \"acquire\"")]
    TakesNoScans,
    /// One scan at a time on each scanner.
    #[error("{}", match .scan {
        Some(scan) => format!("{} is taking the scan {scan}", the_scanner(.scanner)),
        None => "another scan is just being started".to_owned(),
    })]
    ScannerBusy {
        /// The scanner.
        scanner: String,
        /// The other scan.
        scan: Option<String>,
    },
    /// There is no such scanner.
    #[error("there is no scanner {name}; there {} {}", are(.known), .known.join(", "))]
    NoSuchScanner {
        /// As it was given.
        name: String,
        /// Those there are.
        known: Vec<String>,
    },
    /// It could be any of them.
    #[error("there are several scanners, and none is named: {}", .known.join(", "))]
    WhichScanner {
        /// Those there are.
        known: Vec<String>,
    },
    /// The scanner does not do it.
    #[error("{error}")]
    Scanner {
        /// Its section of the configuration.
        section: String,
        /// Why not.
        error: ScannerError,
    },
    /// The scanner cannot do it.
    #[error("{0}")]
    Plan(#[from] PlanError),
    /// The calibration is not for this scanner.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A setting is wrong.
    #[error("{0}")]
    Setting(#[from] OverrideError),
    /// It would have to be cut.
    #[error(
        "the name has {chars} characters; at most {} are allowed",
        relief_api::MAX_NAME_CHARS
    )]
    LongName {
        /// Characters it has.
        chars: usize,
    },
    /// There is no such scan.
    #[error("there is no scan {id}")]
    NoSuchScan {
        /// As it was given.
        id: String,
    },
    /// It ended before.
    #[error("the scan {id} is over ({})", state.as_str())]
    ScanIsOver {
        /// The scan.
        id: String,
        /// How it ended.
        state: ScanState,
    },
    /// It has not ended yet.
    #[error("the scan {id} is still being taken")]
    ScanNotOver {
        /// The scan.
        id: String,
    },
    /// There is nothing to process.
    #[error("nothing is kept of the scan {id}: {why}")]
    NothingKept {
        /// The scan.
        id: String,
        /// Why not.
        why: String,
    },
    /// No scan is under way.
    #[error("{}", match .scanner {
        Some(scanner) => format!("{} is taking no scan", the_scanner(scanner)),
        None => "no scan is under way".to_owned(),
    })]
    NothingToAbort {
        /// The scanner that was meant.
        scanner: Option<String>,
    },
    /// No scan is paused.
    #[error("{}", match .scan {
        Some(scan) => format!("the scan {scan} is not paused"),
        None => "no scan is paused".to_owned(),
    })]
    NothingToResume {
        /// The scan that was meant.
        scan: Option<String>,
    },
    /// It could be any of them.
    #[error("several scans are paused: {}", each(.scans))]
    WhichPaused {
        /// Each scan, and its scanner.
        scans: Vec<(String, String)>,
    },
    /// No scan runs that could be paused.
    #[error("{}", match .scan {
        Some(scan) => format!("the scan {scan} is not running"),
        None => "no scan is running".to_owned(),
    })]
    NothingToPause {
        /// The scan that was meant.
        scan: Option<String>,
    },
    /// It could not go on afterwards, or has not begun.
    #[error("the scan {scan} cannot be paused: {why}")]
    CannotPause {
        /// The scan.
        scan: String,
        /// Why not.
        why: String,
    },
    /// It could be any of them.
    #[error("several scans are running: {}", each(.scans))]
    WhichRunning {
        /// Each scan, and its scanner.
        scans: Vec<(String, String)>,
    },
    /// There is no such job.
    #[error("there is no job {id}")]
    NoSuchJob {
        /// As it was given.
        id: JobId,
    },
    /// It cannot be cancelled, or retried, any more or yet.
    #[error("the job {id} is {} and cannot be {action}", state.as_str())]
    WrongJobState {
        /// The job.
        id: JobId,
        /// Where it stands.
        state: JobState,
        /// What was asked for.
        action: &'static str,
    },
    /// There is no such file in the spool.
    #[error("there is no {what} in the spool")]
    NotInSpool {
        /// The folder or file.
        what: String,
    },
    /// Nothing could be noted of it.
    #[error("no job is known that made {result}, so that nothing can be noted of it")]
    NoRecordOfResult {
        /// The folder.
        result: String,
    },
    /// The disk would get full.
    #[error(
        "there is no room in {folder}: the scan takes up to {}, and {} are to stay free \
         (storage.reserve_mb), but only {} are free{}",
        megabytes(*.scan_bytes), megabytes(*.reserve_bytes), megabytes(*.free_bytes),
        match *.promised_bytes {
            0 => String::new(),
            bytes => format!(", of which scans under way take up to {}", megabytes(bytes)),
        }
    )]
    NoRoom {
        /// The folder that would get full.
        folder: String,
        /// Most bytes that the scan takes there; 0 for the spool.
        scan_bytes: u64,
        /// Bytes that are to stay free.
        reserve_bytes: u64,
        /// Bytes that are free.
        free_bytes: u64,
        /// Bytes of these that scans under way may still take.
        promised_bytes: u64,
    },
    /// Nobody who is told has this name.
    #[error("there is no receiver {name}; there {}", match .known.as_slice() {
        [] => "are none".to_owned(),
        known => format!("{} {}", are(known), known.join(", ")),
    })]
    NoSuchWebhook {
        /// As it was given.
        name: String,
        /// Those there are.
        known: Vec<String>,
    },
    /// There is no such hook.
    #[error("there is no hook {name}; there {}", match .known.as_slice() {
        [] => "are none".to_owned(),
        known => format!("{} {}", are(known), known.join(", ")),
    })]
    NoSuchHook {
        /// As it was given.
        name: String,
        /// Those there are.
        known: Vec<String>,
    },
    /// There is no such upload.
    #[error("there is no upload {name}; there {}", match .known.as_slice() {
        [] => "are none".to_owned(),
        known => format!("{} {}", are(known), known.join(", ")),
    })]
    NoSuchUpload {
        /// As it was given.
        name: String,
        /// Those there are.
        known: Vec<String>,
    },
    /// Nothing is there that a hook could be run for, or that could be copied.
    #[error("there is no result in the spool that it could be tried with")]
    NoResult,
    /// Somebody else is at it.
    #[error("{name} is just being tested")]
    WebhookBusy {
        /// The receiver.
        name: String,
    },
    /// The same request is just being done.
    #[error("a request with this Idempotency-Key is just being done")]
    RequestUnderWay,
    /// Another request had this key.
    #[error("another request with this Idempotency-Key has started the scan {scan}")]
    KeyUsed {
        /// The scan that it started.
        scan: String,
    },
    /// The scan is too large for that.
    #[error("the scan {id} has {samples} samples: more than {most} are not regridded for showing")]
    TooLarge {
        /// The scan.
        id: String,
        /// Samples it has.
        samples: u64,
        /// Most samples.
        most: u64,
    },
    /// So much is shown already.
    #[error("other range images are just being made")]
    Regridding,
    /// The range image cannot be made.
    #[error("scan {id}: {why}")]
    NoImage {
        /// The scan.
        id: String,
        /// Why not, and what to do.
        why: String,
    },
    /// The client has gone.
    #[error("nobody waits for the range image any more")]
    Unwanted,
    /// The records do not work.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The spool does not work.
    #[error(transparent)]
    Spool(#[from] SpoolError),
    /// The tokens do not work.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A file does not work.
    #[error("cannot read {what}: {source}")]
    Io {
        /// The file.
        what: String,
        /// What the system says.
        source: io::Error,
    },
    /// The system has no more threads.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
}

impl ServiceError {
    /// A station's scanner does not do it.
    pub(crate) fn scanner(station: &Station, error: ScannerError) -> Self {
        Self::Scanner {
            section: station.section().to_owned(),
            error,
        }
    }
}

/// A scanner in a sentence; one that nobody has named is "the scanner".
fn the_scanner(name: &str) -> String {
    match name {
        THE_SCANNER => "the scanner".to_owned(),
        name => format!("the scanner {name}"),
    }
}

fn are(list: &[String]) -> &'static str {
    if list.len() == 1 { "is" } else { "are" }
}

/// Scans with their scanners, in words.
fn each(scans: &[(String, String)]) -> String {
    let named = scans
        .iter()
        .map(|(id, scanner)| format!("{id} on {scanner}"));
    named.collect::<Vec<_>>().join(", ")
}

/// A size for people.
pub(crate) fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 * 1e-6)
}

/// What a panic said.
pub(crate) fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// Longest message that may hold something given from outside, in characters.
const MOST_MESSAGE_CHARS: usize = 1_000;

/// A message that repeats what somebody wrote, however long that was.
pub(crate) fn bounded(mut message: String) -> String {
    if let Some((end, _)) = message.char_indices().nth(MOST_MESSAGE_CHARS) {
        message.truncate(end);
        message.push_str(" ...");
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_bounded_between_characters() {
        assert_eq!(bounded("\u{e4}".into()), "\u{e4}");
        let fits = "\u{e4}".repeat(MOST_MESSAGE_CHARS);
        assert_eq!(bounded(fits.clone()), fits);
        assert_eq!(bounded(format!("{fits}x")), format!("{fits} ..."));
    }
}
