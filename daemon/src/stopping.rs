//! The end of a process, as its threads see it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use crate::service::lock;

/// Whether the end has come.
#[derive(Debug, Default)]
pub(crate) struct Stopping {
    has_come: Mutex<bool>,
    told: Condvar,
    /// The same, to be read in innermost loops.
    flag: AtomicBool,
}

impl Stopping {
    /// The end has come.
    pub(crate) fn begin(&self) {
        *lock(&self.has_come) = true;
        self.flag.store(true, Ordering::Relaxed);
        self.told.notify_all();
    }

    /// Whether it has.
    pub(crate) fn has_come(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// Waits for it, but no longer than this; tells whether it has come.
    pub(crate) fn wait(&self, longest: Duration) -> bool {
        if longest.is_zero() {
            return self.has_come();
        }
        let has_come = lock(&self.has_come);
        let waited = self
            .told
            .wait_timeout_while(has_come, longest, |has_come| !*has_come);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}
