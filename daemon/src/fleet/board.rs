//! What is known of this bench's orders: those who wait for one look here.

use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use job_queue::Standing;
use relief_api::JobId;

use crate::service::lock;

/// Where the orders of this bench stand, as far as it was told.
#[derive(Debug, Default)]
pub(super) struct Board {
    standings: Mutex<BTreeMap<JobId, Standing>>,
    told: Condvar,
}

impl Board {
    /// Where an order stands now; nowhere any more if `None`.
    pub(super) fn put(&self, job: JobId, standing: Option<Standing>) {
        let mut standings = lock(&self.standings);
        match standing {
            Some(standing) => standings.insert(job, standing),
            None => standings.remove(&job),
        };
        self.told.notify_all();
    }

    /// Where an order stands, as far as it is known.
    pub(super) fn standing(&self, job: JobId) -> Option<Standing> {
        lock(&self.standings).get(&job).cloned()
    }

    /// Nothing is known any more.
    pub(super) fn clear(&self) {
        lock(&self.standings).clear();
        self.told.notify_all();
    }

    /// Waits for any news, but no longer than this.
    pub(super) fn pause(&self, longest: Duration) {
        let standings = lock(&self.standings);
        let waited = self.told.wait_timeout(standings, longest);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }

    /// Waits for news of an order of which nothing is known; tells whether there are some.
    pub(super) fn pauses(&self, job: JobId, longest: Duration) -> bool {
        let standings = lock(&self.standings);
        let waited = self
            .told
            .wait_timeout_while(standings, longest, |all| !all.contains_key(&job));
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    /// Has all look who wait.
    pub(super) fn wake(&self) {
        // Nobody is between a look and the wait for the next news.
        let _standings = lock(&self.standings);
        self.told.notify_all();
    }

    /// Waits for news of an order that stood so, but no longer than this.
    pub(super) fn wait(&self, job: JobId, known: Option<&Standing>, longest: Duration) {
        let standings = lock(&self.standings);
        if standings.get(&job) == known {
            let waited = self.told.wait_timeout(standings, longest);
            drop(waited.unwrap_or_else(PoisonError::into_inner));
        }
    }
}
