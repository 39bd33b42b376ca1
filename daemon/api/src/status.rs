//! The service at a glance.

use serde::{Deserialize, Serialize};

use crate::laser::LaserEntry;
use crate::scan::Scan;

/// The service at a glance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Status {
    /// Version of the service.
    pub version: String,
    /// Since when it runs, RFC 3339 in UTC.
    pub started_at: String,
    /// The scanner; of several the first, as in `laser` and `scan`.
    pub scanner: ScannerStatus,
    /// Every scanner, in the order of their names; empty from services that had but one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scanners: Vec<ScannerSummary>,
    /// The laser, since its latest change; absent until the scanner was first asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<Box<LaserEntry>>,
    /// The scan under way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<Scan>,
    /// Jobs that wait.
    pub jobs_queued: usize,
    /// Jobs that workers have.
    pub jobs_running: usize,
    /// Where results appear on the service's machine.
    pub spool: String,
    /// Room on the disk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub storage: Option<Box<StorageStatus>>,
}

/// What is kept, and what is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct StorageStatus {
    /// Bytes of the kept scans, as of the last look.
    pub scans_bytes: u64,
    /// Bytes free where scans are kept; `None` where the file system does not tell.
    pub scans_free_bytes: Option<u64>,
    /// Bytes of the results, as of the last look.
    pub results_bytes: u64,
    /// Bytes free where results appear; `None` where the file system does not tell.
    pub results_free_bytes: Option<u64>,
    /// Bytes that are to stay free in both places; a scan that would need them is refused.
    pub reserve_bytes: u64,
}

/// How the service stands with its scanner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScannerLink {
    /// Not spoken to yet.
    Unknown,
    /// Answered last time.
    Ready,
    /// Taking a scan.
    Scanning,
    /// Could not be reached, or reports a fault.
    Trouble,
}

impl ScannerLink {
    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Ready => "ready",
            Self::Scanning => "scanning",
            Self::Trouble => "trouble",
        }
    }
}

/// Name of the only scanner, unless the configuration gives it another.
pub const THE_SCANNER: &str = "scanner";

/// What is known of a scanner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScannerStatus {
    /// Its name; empty from services that had but one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// How the service stands with it.
    pub link: ScannerLink,
    /// Where it is attached, such as a serial port.
    pub endpoint: String,
    /// Model, once it has answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Serial number, once it has answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
    /// Firmware, once it has answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub firmware: Option<String>,
    /// What is wrong, when something is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// The calibration of the mounted scanner that is in force; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationStatus>,
}

/// A calibration in force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct CalibrationStatus {
    /// When the scanner was calibrated, RFC 3339 in UTC.
    pub date: String,
    /// Whole days since.
    pub age_days: i64,
    /// Root mean square of the distances of samples from the reference once corrected.
    pub residual_mm: f64,
    /// Whether it is older than the configuration allows without a warning.
    pub overdue: bool,
}

/// A scanner at a glance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScannerSummary {
    /// What is known of it.
    #[serde(flatten)]
    pub status: ScannerStatus,
    /// Its laser, since its latest change; absent until the scanner was first asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<Box<LaserEntry>>,
    /// Its scan under way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<Scan>,
}

/// The scanners.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScannerList {
    /// In the order of their names; at least one.
    pub scanners: Vec<ScannerSummary>,
}
