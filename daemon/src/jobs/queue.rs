//! Which jobs wait and which run, in memory; the records say the same on disk.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use job_queue::{Order, Stop};
use relief_api::{JobId, Priority};

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
    /// In the order in which they go.
    waiting: BTreeMap<(Priority, JobId), Order>,
    running: BTreeMap<JobId, Arc<StopFlag>>,
    /// Of those that count as running, the ones that wait elsewhere for somebody to begin.
    handed_over: BTreeSet<JobId>,
    stopping: bool,
}

/// Why a running job should stop, if it should.
#[derive(Debug, Default)]
pub(crate) struct StopFlag(AtomicU8);

const RUN: u8 = 0;
const CANCELLED: u8 = 1;
const SERVICE_STOPS: u8 = 2;

impl StopFlag {
    /// Why the job should stop, if it should. That somebody cancelled it outlasts the service's
    /// own end.
    pub(crate) fn why(&self) -> Option<Stop> {
        match self.0.load(Ordering::Relaxed) {
            CANCELLED => Some(Stop::Cancelled),
            SERVICE_STOPS => Some(Stop::WorkerEnds),
            _ => None,
        }
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
    pub(crate) fn add(&self, order: Order) {
        let place = (order.priority, order.key.job);
        lock(&self.state).waiting.insert(place, order);
        // Whoever is woken may be one that cannot do it.
        self.wake.notify_all();
    }

    /// Takes a job out; false if it does not wait.
    pub(crate) fn remove(&self, id: JobId) -> bool {
        let mut state = lock(&self.state);
        let place = state.waiting.keys().find(|(_, job)| *job == id).copied();
        place.is_some_and(|place| state.waiting.remove(&place).is_some())
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

    /// The first waiting job that is fit, now running; waits so long for one. `None` at once when
    /// the service stops.
    pub(crate) fn take(
        &self,
        is_fit: impl Fn(&Order) -> bool,
        longest: Duration,
    ) -> Option<(Order, Arc<StopFlag>)> {
        let end = Instant::now() + longest;
        let mut state = lock(&self.state);
        loop {
            if state.stopping {
                return None;
            }
            let fit = state.waiting.iter().find(|(_, order)| is_fit(order));
            let place = fit.map(|(place, _)| *place);
            if let Some(order) = place.and_then(|place| state.waiting.remove(&place)) {
                let flag = Arc::new(StopFlag::default());
                state.running.insert(order.key.job, Arc::clone(&flag));
                return Some((order, flag));
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            state = self
                .wake
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
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
            state.handed_over.remove(&id);
        }
    }

    /// A job that was taken waits elsewhere for somebody to begin, or does so no more.
    pub(crate) fn waits_elsewhere(&self, id: JobId, waits: bool) {
        let mut state = lock(&self.state);
        if waits && state.running.contains_key(&id) {
            state.handed_over.insert(id);
        } else {
            state.handed_over.remove(&id);
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
        let elsewhere = state.handed_over.len();
        (
            state.waiting.len() + elsewhere,
            state.running.len() - elsewhere,
        )
    }

    /// Jobs that nobody has taken yet.
    pub(crate) fn untaken(&self) -> usize {
        lock(&self.state).waiting.len()
    }
}
