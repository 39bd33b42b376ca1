//! Workers elsewhere, and the jobs that go to them.

use serde::{Deserialize, Serialize};

/// How a service stands with workers elsewhere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Fleet {
    /// Whether jobs go elsewhere at all; if not, nothing else here says anything.
    pub is_used: bool,
    /// What this service is called among the others.
    pub bench: String,
    /// The NATS servers of the configuration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub servers: Vec<String>,
    /// Whether one of them is reached now.
    pub is_connected: bool,
    /// For how long none was reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub away_s: Option<u64>,
    /// What does not work, when something does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// Jobs of this service that were handed over and are not over.
    pub handed_over: usize,
    /// Most that are handed over at a time, as of now.
    pub most_handed_over: usize,
    /// Jobs of all benches, as of the last look; absent before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jobs: Option<FleetJobs>,
    /// Workers, by name, as of the last look.
    #[serde(default)]
    pub workers: Vec<FleetWorker>,
    /// Benches, by name, as of the last look; this one is among them.
    #[serde(default)]
    pub benches: Vec<FleetBench>,
}

/// Jobs of all benches that were handed over.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FleetJobs {
    /// Those that wait and go before all others.
    pub waiting_high: u64,
    /// Those that wait as most do.
    pub waiting_normal: u64,
    /// Those that wait until there is nothing else to be done.
    pub waiting_low: u64,
    /// Those that workers have.
    pub running: u64,
    /// For how long the oldest has waited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub oldest_s: Option<f64>,
}

impl FleetJobs {
    /// All that wait.
    #[must_use]
    pub fn waiting(&self) -> u64 {
        self.waiting_high + self.waiting_normal + self.waiting_low
    }
}

/// A worker.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FleetWorker {
    /// Its name.
    pub name: String,
    /// Version of its program.
    pub version: String,
    /// Oldest and newest format of jobs that it works on.
    pub formats: (u32, u32),
    /// Memory that a job may take there, in MiB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory_mib: Option<u64>,
    /// What is installed there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tools: Vec<String>,
    /// Threads that a job has there.
    pub threads: u32,
    /// The job it works on: the bench's name, a dot, and its number there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub busy_with: Option<String>,
    /// Since when it is there, as it says, RFC 3339.
    pub since: String,
}

/// A bench.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FleetBench {
    /// Its name.
    pub name: String,
    /// Version of its program.
    pub version: String,
    /// Jobs that wait there for their turn to be handed over.
    pub waiting: u64,
    /// Since when it is there, as it says, RFC 3339.
    pub since: String,
}
