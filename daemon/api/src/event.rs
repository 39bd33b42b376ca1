//! What subscribers are told.

use serde::{Deserialize, Serialize};

use crate::job::{Job, JobId};
use crate::laser::LaserEntry;
use crate::scan::Scan;
use crate::status::{ScannerStatus, Status};

/// One server-sent event. Its kind is also the `event:` field of the stream.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// First on every stream, so that nothing is missed between asking and listening.
    Status(Box<Status>),
    /// A scanner was reached, lost, or got into trouble.
    Scanner(ScannerStatus),
    /// A laser was turned on or off, or it is not known any more which of the two it is.
    Laser(LaserEntry),
    /// A scan began or changed its state.
    Scan(Scan),
    /// A column is on disk.
    Column {
        /// The scan.
        scan: String,
        /// Name of the scanner; empty from services that had but one.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        scanner: String,
        /// Columns on disk so far.
        columns: u32,
        /// Columns planned.
        columns_planned: u32,
        /// Returns in this column.
        samples: u32,
        /// x of this column, millimetres.
        x_mm: f64,
        /// Distance of the range image's nodes, millimetres.
        pitch_mm: f64,
        /// Columns of the range image that this one finished.
        live: Vec<LiveColumn>,
    },
    /// A job was made or changed its state.
    Job(Job),
    /// A job came forward.
    Progress {
        /// The job.
        job: JobId,
        /// The scan it processes.
        scan: String,
        /// Name of the scanner; empty from services that did not tell it.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        scanner: String,
        /// What it is at.
        stage: String,
        /// Share of the stage that is done, 0 to 1.
        fraction: f64,
        /// Set when the stage is finished: how long it took.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seconds: Option<f64>,
    },
    /// A result is whole in the spool.
    Published {
        /// The job.
        job: JobId,
        /// The scan it processed.
        scan: String,
        /// Name of the scanner; empty from services that did not tell it.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        scanner: String,
        /// Name of the folder.
        result: String,
        /// The folder on the service's machine.
        directory: String,
        /// Names of its files.
        files: Vec<String>,
    },
    /// This subscriber was too slow and lost events; ask for what is needed.
    Lagged {
        /// How many were lost.
        missed: u64,
    },
    /// Of a kind that this version does not know; never sent.
    #[serde(other)]
    Unknown,
}

impl Event {
    /// The kind, as in the `event:` field.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Status(_) => "status",
            Self::Scanner(_) => "scanner",
            Self::Laser(_) => "laser",
            Self::Scan(_) => "scan",
            Self::Column { .. } => "column",
            Self::Job(_) => "job",
            Self::Progress { .. } => "progress",
            Self::Published { .. } => "published",
            Self::Lagged { .. } => "lagged",
            Self::Unknown => "unknown",
        }
    }
}

/// A finished column of the range image, for showing. Node `k` lies at
/// `(i, j_first + k)` times the pitch.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct LiveColumn {
    /// Lattice index in x.
    pub i: i64,
    /// Lattice index in y of the first node.
    pub j_first: i64,
    /// z of successive nodes upwards in micrometres, `null` where there is none: a
    /// quarter of the bytes of printed floats, and finer than any scanner.
    pub z_um: Vec<Option<i32>>,
}

impl LiveColumn {
    /// Rounds z in millimetres (NaN where there is none) for showing.
    #[must_use]
    pub fn new(i: i64, j_first: i64, z_mm: &[f64]) -> Self {
        let z_um = z_mm
            .iter()
            .map(|z| (!z.is_nan()).then(|| (z * 1e3).round() as i32))
            .collect();
        Self { i, j_first, z_um }
    }

    /// z in millimetres, NaN where there is none.
    pub fn z_mm(&self) -> impl Iterator<Item = f64> + '_ {
        self.z_um
            .iter()
            .map(|z| z.map_or(f64::NAN, |um| f64::from(um) * 1e-3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_live_column_is_compact_and_comes_back() {
        let column = LiveColumn::new(-3, 7, &[1.25, f64::NAN, -0.0004, 12.3456]);
        let text = serde_json::to_string(&column).unwrap();
        assert_eq!(text, r#"{"i":-3,"j_first":7,"z_um":[1250,null,0,12346]}"#);
        let back: LiveColumn = serde_json::from_str(&text).unwrap();
        assert_eq!(back, column);
        let z: Vec<f64> = back.z_mm().collect();
        assert!(z[1].is_nan() && (z[3] - 12.346).abs() < 1e-12, "{z:?}");
    }

    #[test]
    fn an_event_of_a_later_version_is_not_an_error() {
        let event: Event = serde_json::from_str(r#"{"kind":"tea","minutes":3}"#).unwrap();
        assert_eq!(event, Event::Unknown);
    }

    #[test]
    fn an_event_carries_its_kind() {
        let event = Event::Progress {
            job: 3,
            scan: "s".into(),
            scanner: "left".into(),
            stage: "segment".into(),
            fraction: 0.5,
            seconds: None,
        };
        let text = serde_json::to_string(&event).unwrap();
        assert_eq!(
            text,
            r#"{"kind":"progress","job":3,"scan":"s","scanner":"left","stage":"segment","fraction":0.5}"#
        );
        assert_eq!(serde_json::from_str::<Event>(&text).unwrap(), event);
        assert!(text.contains(&format!(r#""kind":"{}""#, event.kind())));
    }

    #[test]
    fn events_of_services_that_did_not_tell_the_scanner_are_read() {
        let text = r#"{"kind":"progress","job":3,"scan":"s","stage":"segment","fraction":0.5}"#;
        let event: Event = serde_json::from_str(text).unwrap();
        assert!(matches!(&event, Event::Progress { scanner, .. } if scanner.is_empty()));
        assert_eq!(serde_json::to_string(&event).unwrap(), text);
    }
}
