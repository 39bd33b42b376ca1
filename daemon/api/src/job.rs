//! Jobs: the processing of a kept scan, and what it leaves in the spool.

use serde::{Deserialize, Serialize};

use crate::scan::SettingOverrides;

/// Number of a job, ascending in the order in which they were made.
pub type JobId = u64;

/// Where a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Waits for a worker.
    Queued,
    /// A worker has it.
    Running,
    /// Its deliverables are in the spool.
    Done,
    /// It gave up; `retry` queues it again.
    Failed,
    /// Given up on request; `retry` queues it again.
    Cancelled,
}

impl JobState {
    /// True once nothing more will come unless it is retried.
    #[must_use]
    pub fn is_over(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }

    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }
}

/// Which job goes first. Those of equal priority go in the order in which they were made.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Default,
    Serialize,
    Deserialize,
    utoipa::ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Priority {
    /// Before all others: somebody waits for it.
    High,
    /// As most are.
    #[default]
    Normal,
    /// When there is nothing else to be done.
    Low,
}

impl Priority {
    /// All, the one that goes first in front.
    pub const ALL: [Self; 3] = [Self::High, Self::Normal, Self::Low];

    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::High => "high",
            Self::Normal => "normal",
            Self::Low => "low",
        }
    }

    /// True for what goes without saying.
    #[must_use]
    #[allow(clippy::trivially_copy_pass_by_ref)] // As serde calls it.
    pub fn is_normal(&self) -> bool {
        *self == Self::Normal
    }
}

/// A job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Job {
    /// Its number.
    pub id: JobId,
    /// The scan it processes.
    pub scan: String,
    /// Name of the scanner that took it; empty in jobs kept by services that did not note it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scanner: String,
    /// The folder in the spool it publishes; the scan's id, or an own one for a rerun.
    pub result: String,
    /// Names the deliverables.
    pub name: String,
    /// Where it stands.
    pub state: JobState,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// What to do about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
    /// Which goes first, of those that wait.
    #[serde(default, skip_serializing_if = "Priority::is_normal")]
    pub priority: Priority,
    /// How often somebody had it queued again.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub turn: u32,
    /// How often it was begun.
    #[serde(default)]
    pub attempts: u32,
    /// How often in a row it was begun without coming to an end, since the service died; the
    /// attempt that runs is one of them. After a few the job is failed.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub cut_short: u32,
    /// When it was made, RFC 3339 in UTC.
    pub queued_at: String,
    /// When the last attempt began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_at: Option<String>,
    /// When the last attempt ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_at: Option<String>,
    /// Who worked on it last, where that was another machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worker: Option<String>,
    /// What the worker is at; `None` unless running.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// Stages that are finished, in order.
    #[serde(default)]
    pub timings: Vec<StageTiming>,
    /// The published folder on the service's machine, once done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub directory: Option<String>,
    /// Deliverables that were asked for and could not be made, and why; the others are there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Settings that differ from the configuration.
    #[serde(default, skip_serializing_if = "SettingOverrides::is_empty")]
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
    /// When its result was first acknowledged, RFC 3339: somebody has it whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_at: Option<String>,
    /// Who did so: the name of a token, or `socket`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_by: Option<String>,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // As serde calls it.
fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// How long a stage took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct StageTiming {
    /// The stage.
    pub stage: String,
    /// Wall-clock time.
    pub seconds: f64,
}

/// The jobs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct JobList {
    /// Newest first.
    pub jobs: Vec<Job>,
    /// There are older ones: `before` of the request for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<JobId>,
}

/// Asks for a kept scan to be processed again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rerun {
    /// Names the deliverables; the scan's name if empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Whether it goes before other jobs, or after them.
    #[serde(skip_serializing_if = "Priority::is_normal")]
    pub priority: Priority,
    /// Settings that differ from those of the scan.
    #[serde(skip_serializing_if = "SettingOverrides::is_empty")]
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
}

/// A folder of the spool.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct SpoolEntry {
    /// The folder's name.
    pub result: String,
    /// Where it is on the service's machine.
    pub directory: String,
    /// Its files by name.
    pub files: Vec<SpoolFile>,
    /// When it was first acknowledged, RFC 3339: somebody has it whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_at: Option<String>,
    /// Who did so: the name of a token, or `socket`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_by: Option<String>,
}

/// A file of the spool.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct SpoolFile {
    /// Its name.
    pub name: String,
    /// Its size.
    pub bytes: u64,
}
