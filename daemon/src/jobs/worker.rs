//! A worker: takes order after order, from whatever queue, until it is to stop.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use job_queue::{Ending, JobQueue, Lease, Order, Outcome, QueueError, Stop, Worker};
use serde_json::Value;

use super::progress::Progress;
use crate::error::panic_text;
use crate::liveness::Pulse;

/// What became of an attempt.
#[derive(Debug)]
pub(crate) enum Made {
    /// What was asked for is where the bench finds it.
    Done {
        /// Where that is.
        result: Value,
        /// What is not there that was asked for, and why.
        left_out: Vec<String>,
    },
    /// It was asked to stop.
    Stopped,
    /// It cannot be done, or not now.
    Failed {
        /// Why not.
        error: String,
        /// What to do about it.
        hint: Option<String>,
    },
}

/// What the log calls a job.
#[derive(Debug)]
pub(crate) struct Names {
    /// Its number; with the bench's name before it where others have theirs, too.
    pub(crate) job: String,
    /// The scan that it processes.
    pub(crate) scan: String,
}

/// How what is ordered is made.
pub(crate) trait Craft {
    /// Makes what is ordered, and puts it where the bench finds it.
    fn make(&self, lease: &dyn Lease, progress: &Progress<'_>) -> Made;

    /// What the log calls a job.
    fn names(&self, order: &Order) -> Names;

    /// What was begun is given up.
    fn discard(&self, lease: &dyn Lease);
}

/// How long a worker waits before it tries again what the queue refused.
const RETRY: Duration = Duration::from_secs(2);
/// How long it waits for an order before it looks whether it is to stop.
const LOOK: Duration = Duration::from_secs(1);
/// A job looks whether it should stop far more often than this, on any machine; one that
/// does not is stuck.
const LONGEST_SILENCE: Duration = Duration::from_secs(15 * 60);

/// A worker at its bench.
pub(crate) struct Hand<'a> {
    pub(crate) queue: &'a dyn JobQueue,
    pub(crate) worker: &'a Worker,
    pub(crate) craft: &'a dyn Craft,
    pub(crate) pulse: &'a Pulse,
    /// Waits so long, and tells whether the worker is to stop.
    pub(crate) is_to_stop: &'a (dyn Fn(Duration) -> bool + Sync),
}

impl Hand<'_> {
    /// Works until it is to stop.
    pub(crate) fn work(&self) {
        while !(self.is_to_stop)(Duration::ZERO) {
            self.work_once(LOOK);
        }
    }

    /// Takes an order if there is one within so long, and sees it to its end; false if there was
    /// none.
    pub(crate) fn work_once(&self, longest: Duration) -> bool {
        match self.queue.take(self.worker, longest) {
            Ok(Some(mut lease)) => {
                self.pulse.work(LONGEST_SILENCE);
                self.see_to(&mut *lease);
                self.pulse.rest();
                true
            }
            Ok(None) => false,
            Err(error) => {
                match error {
                    // Told by the connection, once.
                    QueueError::Away(_) => tracing::debug!(%error, "no jobs can be taken"),
                    _ => tracing::warn!(%error, "cannot take a job; trying again"),
                }
                (self.is_to_stop)(RETRY);
                false
            }
        }
    }

    fn see_to(&self, lease: &mut dyn Lease) {
        let Names { job, scan } = self.craft.names(lease.order());
        tracing::info!(%job, %scan, attempt = lease.begun().attempts, "job begins");
        let (made, timings) = {
            let progress = Progress::new(lease, self.pulse, self.is_to_stop);
            // A defect in the processing of one scan must not end the worker.
            let made = catch_unwind(AssertUnwindSafe(|| self.craft.make(lease, &progress)))
                .unwrap_or_else(|panic| Made::Failed {
                    error: format!("the processing ended unexpectedly: {}", panic_text(&*panic)),
                    hint: Some(
                        "this is a defect of the program: please report it together with the \
                         scan's journal"
                            .into(),
                    ),
                });
            (made, progress.finish())
        };
        if !matches!(made, Made::Done { .. }) {
            self.craft.discard(lease);
        }
        let ending = match made {
            Made::Done { result, left_out } => Ending::Done { result, left_out },
            Made::Failed { error, hint } => Ending::Failed { error, hint },
            Made::Stopped => match lease.stop() {
                Some(Stop::Cancelled) => Ending::Cancelled,
                Some(Stop::Lost) => {
                    tracing::warn!(%job, %scan, "a job is another worker's by now");
                    return;
                }
                Some(Stop::WorkerEnds) | None => {
                    tracing::info!(%job, %scan, "job put back");
                    if let Err(error) = lease.give_back() {
                        tracing::warn!(%job, %scan, %error, "cannot put a job back; its turn comes again");
                    }
                    return;
                }
            },
        };
        self.settle(lease, Outcome { ending, timings });
    }

    fn settle(&self, lease: &mut dyn Lease, mut outcome: Outcome) {
        let Names { job, scan } = self.craft.names(lease.order());
        loop {
            // Who cancelled it was told that it ends so.
            if matches!(outcome.ending, Ending::Failed { .. })
                && lease.stop() == Some(Stop::Cancelled)
            {
                outcome.ending = Ending::Cancelled;
            }
            match lease.settle(&outcome) {
                Ok(standing) => {
                    let state = standing.state.as_str();
                    match &outcome.ending {
                        Ending::Failed { error, .. } => {
                            tracing::warn!(%job, %scan, %error, "job failed");
                        }
                        _ => tracing::info!(%job, %scan, state, "job ends"),
                    }
                    return;
                }
                Err(QueueError::Lost(_)) => {
                    tracing::warn!(%job, %scan, "a job was settled by another worker");
                    return;
                }
                Err(error) => {
                    // The records still say that it runs. A result that is in its place is not
                    // made again.
                    tracing::error!(%job, %scan, %error, "cannot keep what became of a job; trying again");
                    self.pulse.rest();
                    if (self.is_to_stop)(RETRY) || lease.stop() == Some(Stop::Lost) {
                        return;
                    }
                    self.pulse.work(LONGEST_SILENCE);
                }
            }
        }
    }
}
