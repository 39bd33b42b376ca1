//! The scan that covers an object.

use super::{Base, COLUMNS_MAX, Layout, MARGIN_MM, Overrides, SAMPLES_MAX, SetupError, TABLE_MM};
use crate::scanner::{HeadKind, Scanner, Sweep};

/// A sweep that covers the box around the object and a margin.
pub(super) fn propose(
    scanner: &Scanner,
    base: &Base,
    overrides: &Overrides,
    low_mm: [f64; 3],
    high_mm: [f64; 3],
) -> Result<Sweep, SetupError> {
    let count_mm = scanner.mechanics.count_mm();
    let width_mm = high_mm[0] - low_mm[0] + 2.0 * MARGIN_MM;
    let layout = match (overrides.columns, overrides.pitch_mm) {
        (Some(columns), None) => Layout::Count(columns),
        (None, Some(pitch_mm)) | (Some(_), Some(pitch_mm)) => Layout::PitchMm(pitch_mm),
        (None, None) => match base.columns {
            Layout::Count(columns) => Layout::Count(columns),
            Layout::PitchMm(pitch_mm) => Layout::PitchMm(pitch_mm),
        },
    };
    let (pitch_counts, columns) = lay_out(&layout, width_mm / count_mm, count_mm);
    let columns = match overrides.pitch_mm {
        Some(_) => overrides.columns.unwrap_or(columns),
        None => columns,
    };
    if columns > COLUMNS_MAX {
        return Err(SetupError::Setting(format!(
            "that pitch makes {columns} columns; at most {COLUMNS_MAX} are scanned"
        )));
    }
    let middle_counts = ((low_mm[0] + high_mm[0]) / 2.0 - scanner.x_mm(0)) / count_mm;
    let reach_counts = f64::from(pitch_counts) * f64::from(columns.saturating_sub(1));
    let first_table_counts = libm::round(middle_counts - reach_counts / 2.0);
    if first_table_counts < 0.0 || first_table_counts + reach_counts > TABLE_MM / count_mm {
        return Err(SetupError::Setting(format!(
            "{columns} columns {:.3} mm apart do not fit on the table's {TABLE_MM:.0} mm",
            f64::from(pitch_counts) * count_mm
        )));
    }

    let (first, last, lateral_mm) = fan(scanner, low_mm, high_mm);
    let layout = match (overrides.samples, &base.samples) {
        (Some(samples), _) => Layout::Count(samples),
        (None, Layout::Count(samples)) => Layout::Count(*samples),
        (None, Layout::PitchMm(pitch_mm)) => Layout::PitchMm(*pitch_mm),
    };
    let (lateral_step_counts, samples) = lay_out(&layout, last - first, lateral_mm);
    let reach = f64::from(lateral_step_counts) * f64::from(samples.saturating_sub(1));
    Ok(Sweep {
        first_table_counts: first_table_counts as i32,
        pitch_counts,
        columns,
        first_lateral_counts: libm::round((first + last) / 2.0 - reach / 2.0) as i32,
        lateral_step_counts,
        samples: samples.min(SAMPLES_MAX),
    })
}

/// Step in counts and number of places that cover a stretch.
fn lay_out(layout: &Layout, stretch_counts: f64, count_mm: f64) -> (i32, u32) {
    match layout {
        Layout::Count(places) => {
            let gaps = f64::from(places.saturating_sub(1).max(1));
            (libm::ceil(stretch_counts / gaps).max(1.0) as i32, *places)
        }
        Layout::PitchMm(pitch_mm) => {
            let step = libm::round(pitch_mm / count_mm).max(1.0);
            (step as i32, libm::ceil(stretch_counts / step) as u32 + 1)
        }
    }
}

/// First and last lateral in counts that cover the object, and the length of a lateral count
/// at the middle of the object, millimetres.
fn fan(scanner: &Scanner, low_mm: [f64; 3], high_mm: [f64; 3]) -> (f64, f64, f64) {
    let optics = &scanner.optics;
    let tangent = |y_mm: f64, z_mm: f64| (y_mm - optics.camera_y_mm) / (optics.camera_z_mm - z_mm);
    let lowest = low_mm[1] - MARGIN_MM;
    let highest = high_mm[1] + MARGIN_MM;
    let least = tangent(lowest, low_mm[2]).min(tangent(lowest, high_mm[2]));
    let most = tangent(highest, low_mm[2]).max(tangent(highest, high_mm[2]));
    match scanner.head.kind {
        HeadKind::Polar {
            angle_count_nrad, ..
        } => {
            let count_rad = f64::from(angle_count_nrad) * 1e-9;
            let middle_mm = optics.camera_z_mm - (low_mm[2] + high_mm[2]) / 2.0;
            (
                libm::atan(least) / count_rad,
                libm::atan(most) / count_rad,
                count_rad * middle_mm,
            )
        }
        HeadKind::Cartesian {
            count_nm,
            reference_z_mm,
        } => {
            let count_mm = f64::from(count_nm) * 1e-6;
            let depth_mm = optics.camera_z_mm - reference_z_mm;
            let lateral = |t: f64| (optics.camera_y_mm + t * depth_mm) / count_mm;
            (lateral(least), lateral(most), count_mm)
        }
    }
}
