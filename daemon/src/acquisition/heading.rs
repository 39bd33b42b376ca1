//! What stands at the head of a journal about the scanner and what was asked of it: written
//! when a scan begins, and read again when it is taken up.

use relief_api::Scan;
use scan_record::Header;
use scanner_driver::{ColumnSource, InterruptedScan, ScanInfo};
use scanner_protocol::{Identity, ScanPlan, text};
use serde::{Deserialize, Serialize};

use super::plan::ResolvedPlan;
use super::{announced, calibration};
use crate::config::Processing;

/// Who measures.
#[derive(Debug, Serialize, Deserialize)]
struct KeptIdentity {
    model: String,
    serial: String,
    firmware: String,
}

/// What was asked of the scanner, and what it said.
#[derive(Debug, Serialize, Deserialize)]
struct KeptPlan {
    first_table_counts: i32,
    pitch_counts: i32,
    columns: u32,
    first_angle_counts: i32,
    angle_step_counts: i32,
    samples: u16,
    exposure_us: u32,
    /// Journals of earlier versions have none.
    #[serde(default)]
    accepted: Option<Accepted>,
}

/// What the scanner said when it accepted the scan.
#[derive(Debug, Serialize, Deserialize)]
struct Accepted {
    columns: u32,
    spacing_um: u32,
    uniform: bool,
}

/// The head of the journal of a scan that has just been accepted.
pub(super) fn header(
    scan: &Scan,
    processing: &Processing,
    identity: &Identity,
    resolved: &ResolvedPlan,
    info: ScanInfo,
) -> Header {
    let kept = KeptIdentity {
        model: identity.model.as_str().to_owned(),
        serial: identity.serial.as_str().to_owned(),
        firmware: identity.firmware.as_str().to_owned(),
    };
    let plan = KeptPlan::new(&resolved.plan, info);
    // These types serialise to JSON whatever they hold.
    Header {
        calibration: calibration(&identity.calibration),
        column_pitch_mm: resolved.column_pitch_mm,
        sample_spacing_mm: f64::from(info.spacing_um) * 1e-3,
        identity: serde_json::to_vec(&kept).unwrap_or_default(),
        plan: serde_json::to_vec(&plan).unwrap_or_default(),
        settings: serde_json::to_vec(processing).unwrap_or_default(),
        metadata: serde_json::to_vec(scan).unwrap_or_default(),
        correction: Vec::new(),
    }
}

/// The scan whose journal has this head, with no columns yet, and what was asked of the
/// scanner; `None` if the head does not say enough for it to be gone on with.
pub(super) fn interrupted(header: &Header) -> Option<(InterruptedScan, ScanPlan)> {
    let identity: KeptIdentity = serde_json::from_slice(&header.identity).ok()?;
    let kept: KeptPlan = serde_json::from_slice(&header.plan).ok()?;
    let plan = kept.plan();
    let accepted = kept.accepted?;
    let source = ColumnSource {
        model: text(&identity.model),
        serial: text(&identity.serial),
        calibration: announced(&header.calibration)?,
    };
    let info = ScanInfo {
        columns: accepted.columns,
        spacing_um: accepted.spacing_um,
        uniform: accepted.uniform,
    };
    Some((InterruptedScan::new(source, plan, info), plan))
}

impl KeptPlan {
    fn new(plan: &ScanPlan, info: ScanInfo) -> Self {
        Self {
            first_table_counts: plan.first_table_counts,
            pitch_counts: plan.pitch_counts,
            columns: plan.columns,
            first_angle_counts: plan.first_angle_counts,
            angle_step_counts: plan.angle_step_counts,
            samples: plan.samples,
            exposure_us: plan.exposure_us,
            accepted: Some(Accepted {
                columns: info.columns,
                spacing_um: info.spacing_um,
                uniform: info.uniform,
            }),
        }
    }

    fn plan(&self) -> ScanPlan {
        ScanPlan {
            first_table_counts: self.first_table_counts,
            pitch_counts: self.pitch_counts,
            columns: self.columns,
            first_angle_counts: self.first_angle_counts,
            angle_step_counts: self.angle_step_counts,
            samples: self.samples,
            exposure_us: self.exposure_us,
        }
    }
}
