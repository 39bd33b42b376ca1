//! What a bench asks for.

use std::collections::BTreeSet;
use std::fmt;

use relief_api::{JobId, Priority};
use serde::{Deserialize, Serialize};

/// Version of the format of orders, and of what stands in them, that this program writes.
///
/// It goes up when a worker of before could not make of an order what its bench expects.
pub const FORMAT: u32 = 1;

/// The oldest format that this program still works on.
pub const OLDEST_FORMAT: u32 = 1;

/// Longest name of a bench or worker.
const MOST_NAME_CHARS: usize = 32;

/// Name of a bench or of a worker: 1 to 32 letters, digits, `-` and `_`, so that it can be part of
/// a subject, of a bucket's name and of a file's.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BenchName(String);

/// A name that cannot be one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no name: 1 to {MOST_NAME_CHARS} letters, digits, `-` and `_` are")]
pub struct BadName(pub String);

impl BenchName {
    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for BenchName {
    type Error = BadName;

    fn try_from(name: String) -> Result<Self, BadName> {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        if (1..=MOST_NAME_CHARS).contains(&name.len()) && name.chars().all(plain) {
            Ok(Self(name))
        } else {
            Err(BadName(name))
        }
    }
}

impl From<BenchName> for String {
    fn from(name: BenchName) -> Self {
        name.0
    }
}

impl fmt::Display for BenchName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A job among those of all benches.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct JobKey {
    /// The bench whose job it is.
    pub bench: BenchName,
    /// Its number there.
    pub job: JobId,
}

impl fmt::Display for JobKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.bench, self.job)
    }
}

/// What a worker must have for an order.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Need {
    /// Memory that the job may take, in MiB.
    pub memory_mib: u64,
    /// What must be installed, by names that benches and workers agree on.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub tools: BTreeSet<String>,
}

/// A job on its way to a worker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Version of this format and of the body.
    pub format: u32,
    /// Which job it is.
    pub key: JobKey,
    /// Counts how often the bench had the job queued anew: one that is retried is another order.
    pub turn: u32,
    /// Who goes first.
    pub priority: Priority,
    /// What a worker must have.
    pub need: Need,
    /// What is to be done. The queue only carries it.
    pub body: serde_json::Value,
}
