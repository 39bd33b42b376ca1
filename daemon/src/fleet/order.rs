//! What stands in an order that goes elsewhere.

use jiff::Timestamp;
use job_queue::depot::{Bundle, Parcel};
use job_queue::{FORMAT, Need, Order, QueueError};
use relief_api::{Job, Scan};
use serde::{Deserialize, Serialize};

use super::Fleet;

/// Turns count from the time at which a job was made, in seconds since the beginning of 2020: a
/// bench whose records were lost, and whose jobs begin again at 1, does not take what stands there
/// of earlier ones for its own.
const TURNS_BEGIN_S: i64 = 1_577_836_800;

/// Memory that a job takes whatever its scan, in MiB.
const LEAST_MEMORY_MIB: u64 = 256;
/// And so much for each byte of its scan's journal.
const MEMORY_BYTES_PER_BYTE: u64 = 60;

/// What a worker is told of a job.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Work {
    pub(super) job: Job,
    pub(super) scan: Scan,
    /// The scan's columns, in the bench's depot.
    pub(super) journal: Parcel,
}

/// What a worker answers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Answer {
    /// It has made what was asked for.
    Delivered(Delivered),
    /// The columns are not in the depot as the order says, and why: they are to be put there anew.
    Missing(String),
}

/// What a worker tells of what it has made.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Delivered {
    /// The files, in the bench's depot.
    pub(super) bundle: Bundle,
    /// The program that made them.
    pub(super) version: String,
}

/// The turn of a job's order.
pub(super) fn turn(job: &Job) -> u32 {
    let made: Result<Timestamp, _> = job.queued_at.parse();
    let seconds = made.map_or(0, |made| made.as_second() - TURNS_BEGIN_S);
    u32::try_from(seconds.max(0))
        .unwrap_or_default()
        .saturating_add(job.turn)
}

impl Fleet {
    /// A job as it goes elsewhere.
    pub(super) fn order_of(
        &self,
        job: &Job,
        scan: Scan,
        journal: Parcel,
    ) -> Result<Order, QueueError> {
        let memory_bytes = journal.bytes.saturating_mul(MEMORY_BYTES_PER_BYTE);
        let need = Need {
            memory_mib: LEAST_MEMORY_MIB + (memory_bytes >> 20),
            tools: self.config.needs.clone(),
        };
        let work = Work {
            job: job.clone(),
            scan,
            journal,
        };
        let body = serde_json::to_value(work).map_err(|error| QueueError::Damaged {
            what: format!("job {}", job.id),
            why: error.to_string(),
        })?;
        Ok(Order {
            format: FORMAT,
            key: self.key(job.id),
            turn: turn(job),
            priority: job.priority,
            need,
            body,
        })
    }
}
