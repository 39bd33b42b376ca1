//! Scans: what is asked for, and what is known of them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::job::{JobId, Priority};

/// Settings that differ from the service's configuration for one scan or rerun, keyed as
/// in the configuration file: `regrid.neighbours`, `reconstruct.tolerance_mm`.
pub type SettingOverrides = BTreeMap<String, serde_json::Value>;

/// Keys of the configuration, and values as they stand there.
pub(crate) fn settings_schema() -> utoipa::openapi::Object {
    use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, Type};
    ObjectBuilder::new()
        .schema_type(Type::Object)
        .description(Some(
            "Settings that differ, keyed as in the configuration file: `regrid.neighbours`, \
             `reconstruct.tolerance_mm`",
        ))
        .additional_properties(Some(AdditionalProperties::FreeForm(true)))
        .build()
}

/// Most characters in the name of a scan or of a rerun.
pub const MAX_NAME_CHARS: usize = 100;

/// Asks for a scan.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StartScan {
    /// Names the deliverables; `scan` if empty. At most [`MAX_NAME_CHARS`] characters.
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
    /// Name of the scanner; needed where there are several.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub scanner: String,
    /// Whether its job goes before others, or after them.
    #[serde(skip_serializing_if = "Priority::is_normal")]
    pub priority: Priority,
    /// What to measure, where it differs from the configured plan.
    #[serde(
        skip_serializing_if = "PlanRequest::is_empty",
        deserialize_with = "crate::object::only"
    )]
    pub plan: PlanRequest,
    /// How to process, where it differs from the configuration.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
}

/// What to measure. Whatever is left out is taken from the configuration, and what that
/// leaves out is proposed by the scanner.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
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
    /// Number of columns. With a pitch it takes the place of `x_last_mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Angle of the lowest ray, degrees; for heads that turn their ray.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_first_deg: Option<f64>,
    /// Angle of the highest ray, degrees; for heads that turn their ray.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_last_deg: Option<f64>,
    /// y of the lowest sample, millimetres; for profile sensors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_first_mm: Option<f64>,
    /// y of the highest sample, millimetres; for profile sensors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_last_mm: Option<f64>,
    /// Samples in a column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u16>,
    /// Exposure of a sample, microseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<u32>,
}

impl PlanRequest {
    /// This request, with what it leaves out taken from another.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        // A pitch and a number of columns contradict each other, so either displaces both.
        let spacing = if self.pitch_mm.is_some() || self.columns.is_some() {
            self
        } else {
            other
        };
        Self {
            x_first_mm: self.x_first_mm.or(other.x_first_mm),
            x_last_mm: self.x_last_mm.or(other.x_last_mm),
            pitch_mm: spacing.pitch_mm,
            columns: spacing.columns,
            angle_first_deg: self.angle_first_deg.or(other.angle_first_deg),
            angle_last_deg: self.angle_last_deg.or(other.angle_last_deg),
            y_first_mm: self.y_first_mm.or(other.y_first_mm),
            y_last_mm: self.y_last_mm.or(other.y_last_mm),
            samples: self.samples.or(other.samples),
            exposure_us: self.exposure_us.or(other.exposure_us),
        }
    }

    /// True when nothing is asked for in particular.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Where a scan stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanState {
    /// The scanner is being prepared: found, homed.
    Starting,
    /// Columns are coming in.
    Scanning,
    /// Stopped between two columns, with the laser off; the reason says why, and who ends it.
    Paused,
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
        !matches!(self, Self::Starting | Self::Scanning | Self::Paused)
    }

    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Scanning => "scanning",
            Self::Paused => "paused",
            Self::Complete => "complete",
            Self::Aborted => "aborted",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
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
    /// Name of the scanner; empty in records from before scanners had names, when there was
    /// but one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scanner: String,
    /// Whether its first job goes before others, or after them.
    #[serde(default, skip_serializing_if = "Priority::is_normal")]
    pub priority: Priority,
    /// Where it stands.
    pub state: ScanState,
    /// What went wrong, or who ended it; of a paused scan, why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// It is paused until a person says that it may go on.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub needs_person: bool,
    /// When the service last ended in the midst of it, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interruption: Option<Interruption>,
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
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
    /// Jobs that process or processed it, oldest first.
    #[serde(default)]
    pub jobs: Vec<JobId>,
    /// When its columns were removed to make room, RFC 3339; it cannot be run again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed_at: Option<String>,
    /// When columns that had been removed were found again, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub put_back_at: Option<String>,
    /// The request that started it, if that had a key of its own (`Idempotency-Key`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub request: Option<RequestMark>,
}

/// A request that may be sent again without being done again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RequestMark {
    /// The key that the client gave it.
    pub key: String,
    /// SHA-256 of what it asked for: the same key with other wishes is a mistake.
    pub sha256: String,
}

/// The service ended in the midst of a scan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Interruption {
    /// Since when, at the latest, nothing was measured: RFC 3339 in UTC.
    pub since: String,
    /// Columns that were safe on disk.
    pub columns: u32,
    /// How often the service has ended in a row without a new column.
    pub times: u32,
}

/// The scans that were asked to end: read as a [`Scan`], it is the first of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Aborted {
    /// The first of them, in the order of the scanners.
    #[serde(flatten)]
    pub scan: Scan,
    /// Those of other scanners.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<Scan>,
}

/// The scans.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScanList {
    /// Newest first.
    pub scans: Vec<Scan>,
    /// There are older ones: `before` of the request for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_goes_before_the_configuration() {
        let configured = PlanRequest {
            x_first_mm: Some(-50.0),
            x_last_mm: Some(50.0),
            pitch_mm: Some(0.5),
            samples: Some(256),
            ..PlanRequest::default()
        };
        let asked = PlanRequest {
            x_last_mm: Some(10.0),
            columns: Some(20),
            ..PlanRequest::default()
        };
        let merged = asked.or(&configured);
        assert_eq!(
            merged,
            PlanRequest {
                x_first_mm: Some(-50.0),
                x_last_mm: Some(10.0),
                pitch_mm: None,
                columns: Some(20),
                samples: Some(256),
                ..PlanRequest::default()
            }
        );
        assert_eq!(PlanRequest::default().or(&configured), configured);
        assert!(PlanRequest::default().is_empty() && !asked.is_empty());
    }

    #[test]
    fn a_misspelt_wish_is_refused() {
        let error = serde_json::from_str::<StartScan>(r#"{"name":"a","operater":"b"}"#)
            .unwrap_err()
            .to_string();
        assert!(error.contains("unknown field `operater`"), "{error}");
        let list = r#"{"plan":[null,null]}"#;
        let error = serde_json::from_str::<StartScan>(list).unwrap_err();
        assert!(error.to_string().contains("expected an object"), "{error}");
        let plan: StartScan = serde_json::from_str(r#"{"plan":{"pitch_mm":0.5}}"#).unwrap();
        assert_eq!(plan.plan.pitch_mm, Some(0.5));
        let request: StartScan = serde_json::from_str("{}").unwrap();
        assert_eq!(request, StartScan::default());
        assert_eq!(serde_json::to_string(&request).unwrap(), "{}");
    }
}
