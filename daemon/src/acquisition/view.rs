//! What a scan has in view, beside the grid that it shall have.

use pipeline::finest_pitch_mm;
use range_image::Calibration;
use range_image::calibration::Head;

use super::plan::{PlanError, ResolvedPlan};
use crate::config::RegridConfig;

/// Side of the smallest part that a scan may be meant for, as a share of the side of what is in
/// view. How much of it the part will take up is known only from its samples; a grid that would
/// be too fine for a part as small as this is a slip.
const SMALLEST_PART: f64 = 0.1;

/// Refuses a grid that is too fine for whatever the scan may find.
pub(crate) fn check_grid(
    regrid: &RegridConfig,
    resolved: &ResolvedPlan,
    calibration: &Calibration,
) -> Result<(), PlanError> {
    // Without a wish the grid follows the density of the samples.
    let view = View::of(resolved, calibration);
    let sides_mm = view.and_then(|view| view.sides_mm(regrid));
    let (Some(pitch_mm), Some(sides_mm)) = (regrid.pitch_mm, sides_mm) else {
        return Ok(());
    };
    let plan = &resolved.plan;
    let samples = plan.columns as usize * usize::from(plan.samples);
    let part_mm = sides_mm.map(|side| side * SMALLEST_PART);
    let of_part = samples as f64 * SMALLEST_PART * SMALLEST_PART;
    // Where nothing is in view there is no finest pitch.
    let is_too_fine = pitch_mm < finest_pitch_mm(part_mm, of_part as usize);
    if !is_too_fine {
        return Ok(());
    }
    let [width, height] = sides_mm;
    Err(PlanError::new(format!(
        "a grid of {pitch_mm} mm (regrid.pitch_mm) is too fine for {} columns of {} samples over \
         {width:.1} x {height:.1} mm: even a part of {:.1} x {:.1} mm would have {:.0} million \
         nodes; for one that fills the view set regrid.pitch_mm to {} or more, or leave it out",
        plan.columns,
        plan.samples,
        part_mm[0],
        part_mm[1],
        part_mm[0] * part_mm[1] / (pitch_mm * pitch_mm) / 1e6,
        finest_pitch_mm(sides_mm, samples),
    )))
}

/// What the rays of a scan meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// x of the first and of the last column, millimetres.
    pub(super) x_mm: [f64; 2],
    /// y of the first and of the last sample, millimetres: those of a head that turns where the
    /// part frame's z is 0. `None` where that cannot be told.
    pub(super) y_mm: Option<[f64; 2]>,
}

impl View {
    /// `None` for a plan beyond all counts.
    pub(super) fn of(resolved: &ResolvedPlan, calibration: &Calibration) -> Option<Self> {
        let plan = &resolved.plan;
        let last = |first: i32, step: i32, count: u32| {
            let last = i64::from(first) + i64::from(step) * (i64::from(count) - 1);
            i32::try_from(last).ok()
        };
        let y_mm = |lateral: i32| match calibration.head {
            Head::Cartesian { count_mm } => Some(f64::from(lateral) * count_mm),
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                ..
            } => {
                let angle_rad = f64::from(lateral) * angle_count_rad;
                (angle_rad.abs() < std::f64::consts::FRAC_PI_2 && camera_z_mm > 0.0)
                    .then(|| camera_y_mm + camera_z_mm * angle_rad.tan())
            }
        };
        let last_table = last(plan.first_table_counts, plan.pitch_counts, plan.columns)?;
        let last_lateral = last(
            plan.first_angle_counts,
            plan.angle_step_counts,
            plan.samples.into(),
        )?;
        Some(Self {
            x_mm: [plan.first_table_counts, last_table].map(|counts| calibration.x_mm(counts)),
            y_mm: y_mm(plan.first_angle_counts)
                .zip(y_mm(last_lateral))
                .map(|(first, last)| [first, last]),
        })
    }

    /// Width and height of what is met within the region of interest, millimetres.
    pub(super) fn sides_mm(&self, regrid: &RegridConfig) -> Option<[f64; 2]> {
        let y_mm = self.y_mm?;
        Some([
            within(self.x_mm, regrid.roi_x_mm),
            within(y_mm, regrid.roi_y_mm),
        ])
    }
}

/// How much of a stretch lies within limits.
fn within([a_mm, b_mm]: [f64; 2], limits_mm: Option<[f64; 2]>) -> f64 {
    let [low, high] = limits_mm.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    (a_mm.max(b_mm).min(high) - a_mm.min(b_mm).max(low)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scanner_protocol::ScanPlan;

    /// 200 columns over 100 mm; rays from 500 mm over 100 mm.
    fn checked(
        change: impl FnOnce(&mut RegridConfig),
        head: impl FnOnce(&mut Head),
    ) -> Result<(), String> {
        let mut calibration = Calibration {
            table_origin_mm: -50.0,
            table_count_mm: 0.01,
            head: Head::Polar {
                camera_y_mm: 0.0,
                camera_z_mm: 500.0,
                angle_count_rad: 1e-6,
                range_count_mm: 0.1,
            },
            correction: None,
        };
        head(&mut calibration.head);
        let resolved = ResolvedPlan {
            plan: ScanPlan {
                first_table_counts: 0,
                pitch_counts: 50,
                columns: 201,
                first_angle_counts: -99_669,
                angle_step_counts: 996,
                samples: 201,
                exposure_us: 0,
            },
            column_pitch_mm: 0.5,
        };
        let mut regrid = RegridConfig::default();
        change(&mut regrid);
        check_grid(&regrid, &resolved, &calibration).map_err(|error| error.to_string())
    }

    #[test]
    fn a_grid_too_fine_for_any_part_is_refused_with_figures() {
        let polar = |change: fn(&mut RegridConfig)| checked(change, |_| {});
        assert_eq!(polar(|_| {}), Ok(()));
        assert_eq!(polar(|r| r.pitch_mm = Some(0.5)), Ok(()));
        // A part of 10 x 10 mm may have 2^24 nodes: 0.0025 mm.
        assert_eq!(polar(|r| r.pitch_mm = Some(0.0025)), Ok(()));
        let error = polar(|r| r.pitch_mm = Some(0.001)).unwrap_err();
        assert_eq!(
            error,
            "a grid of 0.001 mm (regrid.pitch_mm) is too fine for 201 columns of 201 samples \
             over 100.0 x 99.9 mm: even a part of 10.0 x 10.0 mm would have 100 million nodes; \
             for one that fills the view set regrid.pitch_mm to 0.025 or more, or leave it out"
        );
    }

    #[test]
    fn a_region_of_interest_allows_a_finer_grid() {
        let region = |r: &mut RegridConfig| {
            r.pitch_mm = Some(0.001);
            r.roi_x_mm = Some([-5.0, 5.0]);
            r.roi_y_mm = Some([20.0, 30.0]);
        };
        assert_eq!(checked(region, |_| {}), Ok(()));
        let beside = |r: &mut RegridConfig| {
            r.pitch_mm = Some(1e-9);
            r.roi_x_mm = Some([60.0, 70.0]);
        };
        assert_eq!(checked(beside, |_| {}), Ok(()));
    }

    #[test]
    fn profiles_are_as_wide_as_they_say_and_odd_heads_are_left_to_the_samples() {
        let fine = |r: &mut RegridConfig| r.pitch_mm = Some(0.001);
        let profile = |head: &mut Head| *head = Head::Cartesian { count_mm: 1e-3 };
        let error = checked(fine, profile).unwrap_err();
        assert!(error.contains("over 100.0 x 199.2 mm"), "{error}");
        let behind = |head: &mut Head| {
            if let Head::Polar { camera_z_mm, .. } = head {
                *camera_z_mm = -1.0;
            }
        };
        assert_eq!(checked(fine, behind), Ok(()));
    }
}
