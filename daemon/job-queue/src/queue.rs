//! What every queue keeps to.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::time::Duration;

use relief_api::{JobState, StageTiming};
use serde::{Deserialize, Serialize};

use crate::order::{FORMAT, JobKey, OLDEST_FORMAT, Order};

/// A job that was cut short so often in a row is set aside: it may be what ends its workers, as by
/// the memory that it takes.
pub const MOST_CUT_SHORT: u32 = 3;

/// Where an order stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// The turn of the order that this is about.
    pub turn: u32,
    /// Where it stands, in the same words as jobs.
    pub state: JobState,
    /// How often it was begun.
    pub attempts: u32,
    /// How often in a row it was begun without coming to an end; the attempt that runs is one of
    /// them.
    pub cut_short: u32,
    /// Who had it last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worker: Option<String>,
    /// What the worker is at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// How it ended, once it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Outcome>,
}

/// What became of an order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// Stages that were finished, in order.
    #[serde(default)]
    pub timings: Vec<StageTiming>,
}

/// How an order ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// It is done.
    Done {
        /// Where what was made is found. The queue only carries it.
        result: serde_json::Value,
        /// What was asked for and could not be made, and why.
        left_out: Vec<String>,
    },
    /// It cannot be done, or not now; it is not begun again by itself.
    Failed {
        /// Why not.
        error: String,
        /// What to do about it.
        hint: Option<String>,
    },
    /// The bench wants it no more.
    Cancelled,
}

impl Ending {
    /// The state of a job that ended so.
    #[must_use]
    pub fn state(&self) -> JobState {
        match self {
            Self::Done { .. } => JobState::Done,
            Self::Failed { .. } => JobState::Failed,
            Self::Cancelled => JobState::Cancelled,
        }
    }
}

/// Who works, and what it can.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Worker {
    /// Its name, for people: no two need differ.
    pub name: String,
    /// Formats of orders that it knows.
    pub formats: RangeInclusive<u32>,
    /// Memory that a job may take, in MiB; any amount unless set.
    pub memory_mib: Option<u64>,
    /// What is installed.
    pub tools: BTreeSet<String>,
}

impl Worker {
    /// One of this version, with any amount of memory and no tools.
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            formats: OLDEST_FORMAT..=FORMAT,
            memory_mib: None,
            tools: BTreeSet::new(),
        }
    }

    /// Whether it can do what is asked for.
    #[must_use]
    pub fn can(&self, order: &Order) -> bool {
        self.formats.contains(&order.format)
            && self
                .memory_mib
                .is_none_or(|most| order.need.memory_mib <= most)
            && order.need.tools.is_subset(&self.tools)
    }
}

/// Why a worker should stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The bench wants it no more: to be settled as [`Ending::Cancelled`].
    Cancelled,
    /// The worker is to end: to be given back.
    WorkerEnds,
    /// Somebody else has it, or it is settled: nothing is left to be done.
    Lost,
}

/// The queue could not do what was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum QueueError {
    /// It cannot be reached now; the same may work later.
    #[error("the queue cannot be reached: {0}")]
    Away(String),
    /// It takes no more.
    #[error("the queue is full: {0}")]
    Full(String),
    /// It is not allowed.
    #[error("the queue refuses it: {0}")]
    Refused(String),
    /// The lease is another's, or the order is settled.
    #[error("job {0} is not this worker's any more")]
    Lost(JobKey),
    /// What is kept cannot be read.
    #[error("{what} cannot be read: {why}")]
    Damaged {
        /// Of what.
        what: String,
        /// Why.
        why: String,
    },
    /// The records of the service cannot be kept or read.
    #[error("{0}")]
    Records(String),
}

/// Where jobs wait. Its calls block; none of them is made from an asynchronous task.
pub trait JobQueue: Send + Sync {
    /// An order waits from now on. One whose turn is there already, wherever it stands, changes
    /// nothing; one of a later turn takes the place of an earlier one.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`]. It may then wait all the same: offer it again.
    fn offer(&self, order: &Order) -> Result<(), QueueError>;

    /// An order is not wanted any more. One that waits is cancelled at once, one that runs when its
    /// worker next looks; one that is over, or not there, stays as it is.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    fn cancel(&self, key: &JobKey) -> Result<(), QueueError>;

    /// Where an order stands; `None` if it is not there.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    fn standing(&self, key: &JobKey) -> Result<Option<Standing>, QueueError>;

    /// The next order that this worker can do, waiting so long for one. That it was begun is kept
    /// before this returns. One that was cut short [`MOST_CUT_SHORT`] times is set aside in place
    /// of being given out.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    fn take(
        &self,
        worker: &Worker,
        longest: Duration,
    ) -> Result<Option<Box<dyn Lease>>, QueueError>;
}

/// An order that a worker has. Dropped without being settled or given back, it counts as cut short,
/// as if the worker had died, and is given out again.
pub trait Lease: Send + Sync {
    /// What is to be done.
    fn order(&self) -> &Order;

    /// As it stood when it was begun.
    fn begun(&self) -> &Standing;

    /// Whether the worker should stop. Cheap: to be asked often. Not asking is not being alive:
    /// a queue may give out again what nobody has asked about for long.
    fn stop(&self) -> Option<Stop>;

    /// Tells how far the work is: a stage, which share of it is done, and how long it took if it
    /// is finished. What cannot be told is lost.
    fn tell(&self, stage: &str, fraction: f64, seconds: Option<f64>);

    /// Ends it. Gives how it stands then, which is how the bench will find it: if another worker
    /// was first, as that one settled it.
    ///
    /// # Errors
    /// [`QueueError::Lost`] if it is not there any more or somebody else has it; any other, after
    /// which it may be tried again.
    fn settle(&mut self, outcome: &Outcome) -> Result<Standing, QueueError>;

    /// Lets another worker have it, and does not count as an attempt that was cut short.
    ///
    /// # Errors
    /// As [`Lease::settle`].
    fn give_back(&mut self) -> Result<(), QueueError>;
}
