//! Taking a scan: from the scanner's columns to the journal on disk, and live to whoever
//! looks on.

mod columns;
mod feed;
pub(crate) mod grid_file;
mod heading;
mod keep;
mod live;
mod onlookers;
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
pub(crate) use plan::ResolvedPlan;
pub(crate) use plan::resolve;
use presence::Presence;
pub(crate) use preview::preview;
pub(crate) use run::{Task, Ticket, not_taken_up, run};
pub(crate) use taken_up::{Rest, TakeUp};
pub(crate) use view::check_grid;
pub(crate) use watch::{describe_trouble, watch};

const NM_PER_MM: f64 = 1e6;
const PM_PER_MM: f64 = 1e9;
const PRAD_PER_RAD: f64 = 1e12;

/// What the device announced, as the geometry needs it.
pub(crate) fn calibration(wire: &scanner_protocol::Calibration) -> Calibration {
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
        correction: None,
    }
}

/// What a device announced that gave this calibration, whatever the correction; `None` if none
/// can have.
pub(crate) fn announced(known: &Calibration) -> Option<scanner_protocol::Calibration> {
    // Beyond what can be announced these saturate, and are found not to be the same.
    let nm = |mm: f64| (mm * NM_PER_MM).round() as i64;
    let pm = |mm: f64| (mm * PM_PER_MM).round() as u32;
    let wire = scanner_protocol::Calibration {
        table_count_pm: pm(known.table_count_mm),
        table_origin_nm: nm(known.table_origin_mm),
        head: match known.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => scanner_protocol::Head::Polar {
                camera_y_nm: nm(camera_y_mm),
                camera_z_nm: nm(camera_z_mm),
                angle_count_prad: (angle_count_rad * PRAD_PER_RAD).round() as u32,
                range_count_pm: pm(range_count_mm),
            },
            Head::Cartesian { count_mm } => scanner_protocol::Head::Cartesian {
                count_pm: pm(count_mm),
            },
        },
    };
    (calibration(&wire) == known.as_announced()).then_some(wire)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_announced_is_found_again() {
        let odd = [1, 333_333, 10_000_001, u32::MAX];
        for (count, place_nm) in odd.into_iter().zip([0, -7, 123_456_789_012, 1 << 52]) {
            let polar = scanner_protocol::Head::Polar {
                camera_y_nm: place_nm,
                camera_z_nm: -place_nm,
                angle_count_prad: count,
                range_count_pm: count,
            };
            let cartesian = scanner_protocol::Head::Cartesian { count_pm: count };
            for head in [polar, cartesian] {
                let wire = scanner_protocol::Calibration {
                    table_count_pm: count,
                    table_origin_nm: place_nm,
                    head,
                };
                assert_eq!(announced(&calibration(&wire)), Some(wire));
            }
        }
    }

    #[test]
    fn what_no_device_can_announce_is_refused() {
        let known = |table_count_mm| Calibration {
            table_origin_mm: 0.0,
            table_count_mm,
            head: Head::Cartesian { count_mm: 0.01 },
            correction: None,
        };
        assert!(announced(&known(0.01)).is_some());
        for odd in [0.010_000_000_1, -0.01, 5.0, f64::NAN, f64::INFINITY] {
            assert_eq!(announced(&known(odd)), None, "{odd}");
        }
    }
}
