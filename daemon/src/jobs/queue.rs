//! Which jobs wait and which run, in memory; the records say the same on disk.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use relief_api::JobId;

use crate::service::lock;

/// Which jobs wait and which run.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    state: Mutex<State>,
    wake: Condvar,
    /// Held while a job's state is read, judged and changed.
    order: Mutex<()>,
}

#[derive(Debug, Default)]
struct State {
    waiting: BTreeSet<JobId>,
    running: BTreeMap<JobId, Arc<StopFlag>>,
    /// Of those that wait after an attempt whose outcome could not be kept.
    begun: BTreeMap<JobId, Arc<StopFlag>>,
    stopping: bool,
}

/// Why a running job should stop, if it should.
#[derive(Debug, Default)]
pub(crate) struct StopFlag(AtomicU8);

const RUN: u8 = 0;
const CANCELLED: u8 = 1;
const SERVICE_STOPS: u8 = 2;

impl StopFlag {
    /// True once the job should stop, for whatever reason.
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed) != RUN
    }

    /// True when somebody cancelled the job, which outlasts the service's own end.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) == CANCELLED
    }

    fn set(&self, why: u8) {
        // The first reason stays.
        let _ = self
            .0
            .compare_exchange(RUN, why, Ordering::Relaxed, Ordering::Relaxed);
    }
}

impl Queue {
    /// Serialises changes of job states.
    pub(crate) fn changing(&self) -> MutexGuard<'_, ()> {
        lock(&self.order)
    }

    /// A job waits.
    pub(crate) fn add(&self, id: JobId) {
        lock(&self.state).waiting.insert(id);
        self.wake.notify_one();
    }

    /// A job counts as running although its attempt has ended, so that it can be cancelled.
    pub(crate) fn hold(&self, id: JobId, flag: &Arc<StopFlag>) {
        lock(&self.state).running.insert(id, Arc::clone(flag));
    }

    /// A job that is held waits for another attempt, which stops if this one was to stop.
    pub(crate) fn add_again(&self, id: JobId, flag: Arc<StopFlag>) {
        self.end(id, &flag);
        lock(&self.state).begun.insert(id, flag);
        self.add(id);
    }

    /// Takes a job out; false if it does not wait.
    pub(crate) fn remove(&self, id: JobId) -> bool {
        let mut state = lock(&self.state);
        state.begun.remove(&id);
        state.waiting.remove(&id)
    }

    /// Asks a running job to stop; false if it does not run.
    pub(crate) fn cancel_running(&self, id: JobId) -> bool {
        let state = lock(&self.state);
        let flag = state.running.get(&id);
        if let Some(flag) = flag {
            flag.set(CANCELLED);
        }
        flag.is_some()
    }

    /// The oldest waiting job, now running; waits for one. `None` once the service stops.
    pub(crate) fn take(&self) -> Option<(JobId, Arc<StopFlag>)> {
        let mut state = lock(&self.state);
        loop {
            if state.stopping {
                return None;
            }
            if let Some(id) = state.waiting.pop_first() {
                let flag = state.begun.remove(&id).unwrap_or_default();
                state.running.insert(id, Arc::clone(&flag));
                return Some((id, flag));
            }
            state = self
                .wake
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The attempt with this flag runs no more; another one at the same job goes on.
    pub(crate) fn end(&self, id: JobId, flag: &Arc<StopFlag>) {
        let mut state = lock(&self.state);
        if state
            .running
            .get(&id)
            .is_some_and(|running| Arc::ptr_eq(running, flag))
        {
            state.running.remove(&id);
        }
    }

    /// No job is begun any more, and those that run are asked to stop.
    pub(crate) fn stop(&self) {
        let mut state = lock(&self.state);
        state.stopping = true;
        for flag in state.running.values() {
            flag.set(SERVICE_STOPS);
        }
        self.wake.notify_all();
    }

    /// Jobs waiting and running.
    pub(crate) fn counts(&self) -> (usize, usize) {
        let state = lock(&self.state);
        (state.waiting.len(), state.running.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cancel_outlasts_an_attempt_whose_outcome_is_not_kept() {
        for cancelled_while_held in [false, true] {
            let queue = Queue::default();
            queue.add(1);
            let (id, flag) = queue.take().unwrap();
            if !cancelled_while_held {
                assert!(queue.cancel_running(id));
            }
            queue.end(id, &flag);
            assert!(!queue.cancel_running(id));
            queue.hold(id, &flag);
            if cancelled_while_held {
                assert!(queue.cancel_running(id));
            }
            queue.add_again(id, flag);
            assert_eq!(queue.counts(), (1, 0));
            let (again, flag) = queue.take().unwrap();
            assert_eq!(again, id);
            assert!(flag.is_cancelled());
            // A job that is retried later begins afresh.
            queue.end(id, &flag);
            queue.add(id);
            assert!(!queue.take().unwrap().1.is_set());
        }
    }
}
