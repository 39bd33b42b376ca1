//! Taking a scan: from the scanner's columns to the journal on disk, and live to whoever
//! looks on.

mod columns;
mod feed;
pub(crate) mod grid_file;
mod heading;
mod keep;
mod live;
mod plan;
pub(crate) mod presence;
mod preview;
mod run;
mod taken_up;
mod view;
mod watch;

use std::sync::{Mutex, PoisonError};

use range_image::{Calibration, calibration::Head};

pub use plan::PlanError;
pub(crate) use plan::resolve;
use presence::Presence;
pub(crate) use preview::preview;
pub(crate) use run::{Task, Ticket, not_taken_up, run};
pub(crate) use taken_up::{Rest, TakeUp};
pub(crate) use view::check_grid;
pub(crate) use watch::{describe_trouble, watch};

/// What the device announced, as the geometry needs it.
pub(crate) fn calibration(wire: &scanner_protocol::Calibration) -> Calibration {
    const NM_PER_MM: f64 = 1e6;
    const PM_PER_MM: f64 = 1e9;
    const PRAD_PER_RAD: f64 = 1e12;
    Calibration {
        table_origin_mm: wire.table_origin_nm as f64 / NM_PER_MM,
        table_count_mm: f64::from(wire.table_count_pm) / PM_PER_MM,
        head: match wire.head {
            scanner_protocol::Head::Polar {
                camera_y_nm,
                camera_z_nm,
                angle_count_prad,
                range_count_pm,
            } => Head::Polar {
                camera_y_mm: camera_y_nm as f64 / NM_PER_MM,
                camera_z_mm: camera_z_nm as f64 / NM_PER_MM,
                angle_count_rad: f64::from(angle_count_prad) / PRAD_PER_RAD,
                range_count_mm: f64::from(range_count_pm) / PM_PER_MM,
            },
            scanner_protocol::Head::Cartesian { count_pm } => Head::Cartesian {
                count_mm: f64::from(count_pm) / PM_PER_MM,
            },
        },
    }
}

/// A request to end a scan early, and by whom.
#[derive(Debug)]
pub(crate) struct AbortRequest {
    reason: Mutex<Option<String>>,
    /// Whether another start of the service may go on with the scan by itself.
    pub(crate) presence: Presence,
}

impl AbortRequest {
    /// None so far, of a scan with this presence.
    pub(crate) fn none(presence: Presence) -> Self {
        Self {
            reason: Mutex::default(),
            presence,
        }
    }

    /// Asks for the end; the first reason stays.
    pub(crate) fn ask(&self, reason: &str) {
        self.reason
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert_with(|| reason.to_owned());
    }

    /// Why the end was asked for, if it was.
    pub(crate) fn reason(&self) -> Option<String> {
        self.reason
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}
