//! How long to wait for an event at most, and what a wait for a result gives.

use std::time::Duration;

use relief_api::{Job, Scan};

/// Keeps a broken test from hanging; no test that works comes near it, however slow the
/// machine.
pub const GUARD: Duration = Duration::from_secs(300);

/// A scan with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// The complete scan.
    pub scan: Scan,
    /// The job that published its result.
    pub job: Job,
}
