//! Scans: what is asked for, and what is known of them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::job::JobId;

/// Settings that differ from the service's configuration for one scan or rerun, keyed as
/// in the configuration file: `regrid.neighbours`, `reconstruct.tolerance_mm`.
pub type SettingOverrides = BTreeMap<String, serde_json::Value>;

/// Asks for a scan.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartScan {
    /// Names the deliverables; `scan` if empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The part measured, such as its number; carried into the report.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// Who measures; carried into the report.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub operator: String,
    /// Anything else; carried into the report.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// What to measure, where it differs from the configured plan.
    #[serde(skip_serializing_if = "PlanRequest::is_empty")]
    pub plan: PlanRequest,
    /// How to process, where it differs from the configuration.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: SettingOverrides,
}

/// What to measure. Whatever is left out is taken from the configuration, and what that
/// leaves out is proposed by the scanner.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanRequest {
    /// x of the first column in the part frame, millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_first_mm: Option<f64>,
    /// x beyond which no column lies, millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_last_mm: Option<f64>,
    /// Distance of neighbouring columns, millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch_mm: Option<f64>,
    /// Number of columns, instead of `x_last_mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Angle of the lowest ray, degrees (polar heads), or its y in millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_first_deg: Option<f64>,
    /// Angle of the highest ray, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_last_deg: Option<f64>,
    /// Rays in a column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u16>,
    /// Exposure of a sample, microseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<u32>,
}

impl PlanRequest {
    /// True when nothing is asked for in particular.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Where a scan stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScanState {
    /// The scanner is being prepared: found, homed.
    Starting,
    /// Columns are coming in.
    Scanning,
    /// All columns are kept.
    Complete,
    /// Ended on request; the columns so far are kept.
    Aborted,
    /// Ended by a fault; the columns so far are kept.
    Failed,
    /// The service ended in the middle; the columns so far are kept.
    Interrupted,
}

impl ScanState {
    /// True once nothing more will come.
    #[must_use]
    pub fn is_over(self) -> bool {
        !matches!(self, Self::Starting | Self::Scanning)
    }

    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Scanning => "scanning",
            Self::Complete => "complete",
            Self::Aborted => "aborted",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Sorts by time and is safe as a file name; also the name of its folder in the spool.
    pub id: String,
    /// Names the deliverables.
    pub name: String,
    /// The part measured.
    #[serde(default)]
    pub part: String,
    /// Who measured.
    #[serde(default)]
    pub operator: String,
    /// Anything else.
    #[serde(default)]
    pub note: String,
    /// Where it stands.
    pub state: ScanState,
    /// What went wrong, or who ended it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Start, RFC 3339 in UTC.
    pub started_at: String,
    /// End, RFC 3339 in UTC.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_at: Option<String>,
    /// Columns the scanner will take; 0 until it has said so.
    #[serde(default)]
    pub columns_planned: u32,
    /// Columns safe on disk.
    #[serde(default)]
    pub columns: u32,
    /// Settings that differ from the configuration.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: SettingOverrides,
    /// Jobs that process or processed it, oldest first.
    #[serde(default)]
    pub jobs: Vec<JobId>,
}

/// The scans.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ScanList {
    /// Newest first.
    pub scans: Vec<Scan>,
}
