//! Room on the disk that scans under way may still take.
//!
//! A scan's journal sets its room aside when the scanner has begun, and on some file systems
//! never; until then the room looks free to a scan that begins on another scanner.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use crate::error::ServiceError;
use crate::service::lock;
use crate::space::on_disk;

/// What was promised to the scans under way: journals, and the most bytes of each.
#[derive(Debug, Default)]
pub(crate) struct Promises(Mutex<Vec<(PathBuf, u64)>>);

/// Room for a scan; what it has not taken is free again when this is dropped.
#[derive(Debug)]
pub(crate) struct Promise {
    all: Arc<Promises>,
    journal: PathBuf,
}

impl Drop for Promise {
    fn drop(&mut self) {
        lock(&self.all.0).retain(|(journal, _)| *journal != self.journal);
    }
}

impl Promises {
    /// Bytes that scans under way may still take.
    pub(crate) fn outstanding(&self) -> u64 {
        outstanding(&lock(&self.0))
    }

    /// Makes a promise, unless `check` refuses it; it is given the bytes that earlier ones may
    /// still take. One at a time, so that no two are given the same room; so `check` must not
    /// wait for anything whose holder may just let go of a promise, as a scan's slot.
    pub(crate) fn make(
        self: &Arc<Self>,
        journal: PathBuf,
        bytes: u64,
        check: impl FnOnce(u64) -> Result<(), ServiceError>,
    ) -> Result<Promise, ServiceError> {
        let mut promises = lock(&self.0);
        check(outstanding(&promises))?;
        promises.push((journal.clone(), bytes));
        Ok(Promise {
            all: Arc::clone(self),
            journal,
        })
    }
}

fn outstanding(promises: &[(PathBuf, u64)]) -> u64 {
    promises
        .iter()
        .map(|(journal, bytes)| bytes.saturating_sub(taken_bytes(journal)))
        .fold(0, u64::saturating_add)
}

/// Bytes that a journal has taken of its disk, those set aside included.
pub(super) fn taken_bytes(journal: &Path) -> u64 {
    fs::metadata(journal).map_or(0, |journal| on_disk(&journal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_journal_has_taken_is_promised_no_more() {
        let folder = tempfile::tempdir().unwrap();
        let journal = folder.path().join("a.scan");
        let promises = Arc::new(Promises::default());
        let most = 10 << 20;
        let first = promises.make(journal.clone(), most, |_| Ok(())).unwrap();
        assert_eq!(promises.outstanding(), most);
        let second = promises.make("b".into(), 7, |before| {
            assert_eq!(before, most);
            Ok(())
        });
        assert_eq!(promises.outstanding(), most + 7);
        drop(second);
        fs::write(&journal, vec![1; 1 << 20]).unwrap();
        fs::File::open(&journal).unwrap().sync_all().unwrap();
        let left = promises.outstanding();
        assert!(left <= most - (1 << 20) && left > 0, "{left}");
        drop(first);
        assert_eq!(promises.outstanding(), 0);
    }

    #[test]
    fn a_refused_promise_is_none() {
        let promises = Arc::new(Promises::default());
        let refused = promises.make("a".into(), 5, |_| Err(ServiceError::Stopping));
        assert!(refused.is_err());
        assert_eq!(promises.outstanding(), 0);
    }
}
