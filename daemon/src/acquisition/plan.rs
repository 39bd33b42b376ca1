//! From millimetres and degrees to what the scanner is asked for, within its limits.

use range_image::calibration::Head;
use relief_api::PlanRequest;
use scanner_protocol::{Identity, Limits, ScanPlan};

/// The scan asked for is not possible on this scanner.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct PlanError(String);

impl PlanError {
    pub(super) fn new(what: String) -> Self {
        Self(what)
    }
}

/// A plan and what follows from it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ResolvedPlan {
    pub(crate) plan: ScanPlan,
    /// Distance of neighbouring columns, positive.
    pub(crate) column_pitch_mm: f64,
}

/// An axis of the scanner in the user's unit.
struct Axis {
    name: &'static str,
    unit: &'static str,
    origin: f64,
    per_count: f64,
    low_counts: i32,
    high_counts: i32,
}

impl Axis {
    fn value(&self, counts: i32) -> f64 {
        self.origin + f64::from(counts) * self.per_count
    }

    /// Position in counts; half a count beyond a limit still counts as on it.
    fn counts(&self, value: f64) -> Result<i32, PlanError> {
        let counts = ((value - self.origin) / self.per_count).round();
        if counts >= f64::from(self.low_counts) && counts <= f64::from(self.high_counts) {
            return Ok(counts as i32);
        }
        Err(PlanError(format!(
            "{value} {unit} is beyond the scanner's {}, which goes from {:.3} to {:.3} {unit}",
            self.name,
            self.value(self.low_counts),
            self.value(self.high_counts),
            unit = self.unit,
        )))
    }

    /// First and last position, each as asked for or else as proposed.
    fn range(
        &self,
        asked: (Option<f64>, Option<f64>),
        proposed: (i32, i32),
    ) -> Result<(i32, i32), PlanError> {
        Ok((
            asked.0.map_or(Ok(proposed.0), |value| self.counts(value))?,
            asked.1.map_or(Ok(proposed.1), |value| self.counts(value))?,
        ))
    }
}

/// The scan that is asked for, in this scanner's counts.
pub(crate) fn resolve(
    request: &PlanRequest,
    identity: &Identity,
) -> Result<ResolvedPlan, PlanError> {
    let limits = &identity.limits;
    let calibration = super::calibration(&identity.calibration);
    let table = Axis {
        name: "table",
        unit: "mm",
        origin: calibration.table_origin_mm,
        per_count: calibration.table_count_mm,
        low_counts: limits.table_min_counts,
        high_counts: limits.table_max_counts,
    };
    let proposed = &limits.proposed;
    let (first, pitch, columns) = columns(request, &table, limits.max_columns, proposed)?;
    let lateral = Axis {
        low_counts: limits.lateral_min_counts,
        high_counts: limits.lateral_max_counts,
        ..lateral_axis(request, &calibration.head)?
    };
    let asked = match calibration.head {
        Head::Polar { .. } => (request.angle_first_deg, request.angle_last_deg),
        Head::Cartesian { .. } => (request.y_first_mm, request.y_last_mm),
    };
    let exposure_us = request.exposure_us.unwrap_or(proposed.exposure_us);
    if exposure_us != 0 && !(limits.min_exposure_us..=limits.max_exposure_us).contains(&exposure_us)
    {
        return Err(PlanError(format!(
            "an exposure of {exposure_us} us is not possible: this scanner takes {} to {} us",
            limits.min_exposure_us, limits.max_exposure_us
        )));
    }
    let (low, step, samples) = if asked == (None, None) && request.samples.is_none() {
        (
            proposed.first_angle_counts,
            proposed.angle_step_counts,
            proposed.samples,
        )
    } else {
        laterals(&lateral, asked, request.samples, limits)?
    };
    Ok(ResolvedPlan {
        plan: ScanPlan {
            first_table_counts: first,
            pitch_counts: pitch,
            columns,
            first_angle_counts: low,
            angle_step_counts: step,
            samples,
            exposure_us,
        },
        column_pitch_mm: f64::from(pitch.unsigned_abs()) * calibration.table_count_mm.abs(),
    })
}

/// First sample, step and number of samples, when some of it is asked for.
fn laterals(
    lateral: &Axis,
    asked: (Option<f64>, Option<f64>),
    samples: Option<u16>,
    limits: &Limits,
) -> Result<(i32, i32, u16), PlanError> {
    let proposed = &limits.proposed;
    let (low, high) = lateral.range(
        asked,
        ends(
            proposed.first_angle_counts,
            proposed.angle_step_counts,
            proposed.samples.into(),
        ),
    )?;
    let samples = samples.unwrap_or(proposed.samples);
    if samples < 2 || samples > limits.max_samples {
        return Err(PlanError(format!(
            "{samples} samples in a column are not possible: this scanner takes 2 to {}",
            limits.max_samples
        )));
    }
    let step = (i64::from(high) - i64::from(low)) / (i64::from(samples) - 1);
    if step == 0 {
        return Err(PlanError(format!(
            "{samples} samples between {:.4} and {:.4} {} are closer than this scanner's \
             counts: ask for fewer samples or a wider range",
            lateral.value(low),
            lateral.value(high),
            lateral.unit
        )));
    }
    // Between two counts of 32 bits, divided by at least 1.
    Ok((low, saturated(step), samples))
}

/// First and last of evenly spaced positions.
fn ends(first: i32, step: i32, count: u32) -> (i32, i32) {
    let last = i64::from(first) + i64::from(step) * (i64::from(count) - 1);
    (first, saturated(last))
}

fn saturated(counts: i64) -> i32 {
    counts.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// First position, pitch and number of columns.
fn columns(
    request: &PlanRequest,
    table: &Axis,
    max_columns: u32,
    proposed: &ScanPlan,
) -> Result<(i32, i32, u32), PlanError> {
    let asked = (request.x_first_mm, request.x_last_mm);
    let own = (proposed.first_table_counts, proposed.pitch_counts);
    if asked == (None, None) && request.pitch_mm.is_none() && request.columns.is_none() {
        return Ok((own.0, own.1, proposed.columns));
    }
    let (first, last) = table.range(asked, ends(own.0, own.1, proposed.columns))?;
    let span = i64::from(last) - i64::from(first);
    let pitch_mm = match (request.pitch_mm, request.columns) {
        // Another range alone keeps the scanner's pitch.
        (None, None) => Some(f64::from(own.1.unsigned_abs()) * table.per_count),
        (pitch_mm, _) => pitch_mm,
    };
    let (pitch, columns) = match (pitch_mm, request.columns) {
        (None, columns) => {
            let columns = i64::from(columns.unwrap_or(proposed.columns));
            (span / (columns - 1).max(1), columns)
        }
        (Some(pitch_mm), columns) => {
            let counts = (pitch_mm / table.per_count).round();
            if !(counts >= 1.0 && counts <= f64::from(i32::MAX)) {
                return Err(PlanError(format!(
                    "a column pitch of {pitch_mm} mm is not possible: the table's finest step \
                     is {} mm",
                    table.per_count
                )));
            }
            let pitch = counts as i64 * if span < 0 { -1 } else { 1 };
            let columns = columns.map_or(span / pitch + 1, i64::from);
            // The end must lie on the table too.
            let end = i64::from(first) + pitch * (columns - 1).max(0);
            table.counts(table.origin + end as f64 * table.per_count)?;
            (pitch, columns)
        }
    };
    if columns < 1 || columns > i64::from(max_columns) {
        return Err(PlanError(format!(
            "{columns} columns are not possible: this scanner takes 1 to {max_columns}; choose \
             another range or pitch"
        )));
    }
    if pitch == 0 {
        return Err(PlanError(format!(
            "{columns} columns between {:.4} and {:.4} mm are closer than the table's counts: \
             ask for fewer columns or a wider range",
            table.value(first),
            table.value(last)
        )));
    }
    Ok((first, saturated(pitch), columns as u32))
}

/// The axis along a column; its limits are those of the table until set.
fn lateral_axis(request: &PlanRequest, head: &Head) -> Result<Axis, PlanError> {
    let (name, unit, per_count) = match *head {
        Head::Polar {
            angle_count_rad, ..
        } => {
            if request.y_first_mm.or(request.y_last_mm).is_some() {
                return Err(PlanError(
                    "this scanner turns its ray: give angle_first_deg and angle_last_deg \
                     instead of y_first_mm and y_last_mm"
                        .into(),
                ));
            }
            ("field of view", "degrees", angle_count_rad.to_degrees())
        }
        Head::Cartesian { count_mm } => {
            if request.angle_first_deg.or(request.angle_last_deg).is_some() {
                return Err(PlanError(
                    "this scanner is a profile sensor: give y_first_mm and y_last_mm instead \
                     of angle_first_deg and angle_last_deg"
                        .into(),
                ));
            }
            ("field of view", "mm", count_mm)
        }
    };
    Ok(Axis {
        name,
        unit,
        origin: 0.0,
        per_count,
        low_counts: 0,
        high_counts: 0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scanner_protocol::{Calibration, Head as WireHead, text};

    /// Table of 10 um counts from -60 to 60 mm; rays in 1 mrad counts, +-100 mrad.
    fn identity() -> Identity {
        Identity {
            model: text("m"),
            serial: text("s"),
            firmware: text("f"),
            calibration: Calibration {
                table_count_pm: 10_000_000,
                table_origin_nm: -60_000_000,
                head: WireHead::Polar {
                    camera_y_nm: 0,
                    camera_z_nm: 750_000_000,
                    angle_count_prad: 1_000_000_000,
                    range_count_pm: 100_000_000,
                },
            },
            limits: Limits {
                table_min_counts: 0,
                table_max_counts: 12_000,
                lateral_min_counts: -100,
                lateral_max_counts: 100,
                max_line_rate_millihz: 0,
                max_columns: 1_000,
                max_samples: 256,
                max_credits: 8,
                min_exposure_us: 10,
                max_exposure_us: 1_000,
                min_dead_man_ms: 100,
                max_dead_man_ms: 5_000,
                proposed: ScanPlan {
                    first_table_counts: 1_000,
                    pitch_counts: 50,
                    columns: 200,
                    first_angle_counts: -80,
                    angle_step_counts: 2,
                    samples: 81,
                    exposure_us: 0,
                },
            },
        }
    }

    fn planned(change: impl FnOnce(&mut PlanRequest)) -> Result<ScanPlan, String> {
        let mut request = PlanRequest::default();
        change(&mut request);
        resolve(&request, &identity())
            .map(|resolved| resolved.plan)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn without_wishes_the_scanner_decides() {
        let resolved = resolve(&PlanRequest::default(), &identity()).unwrap();
        assert_eq!(resolved.plan, identity().limits.proposed);
        assert!((resolved.column_pitch_mm - 0.5).abs() < 1e-12);
    }

    #[test]
    fn wishes_are_met_in_counts() {
        let plan = planned(|r| {
            (r.x_first_mm, r.x_last_mm, r.pitch_mm) = (Some(-50.0), Some(50.0), Some(0.25));
        })
        .unwrap();
        assert_eq!(
            (plan.first_table_counts, plan.pitch_counts, plan.columns),
            (1_000, 25, 401)
        );
        let plan = planned(|r| (r.x_first_mm, r.columns) = (Some(0.0), Some(10))).unwrap();
        // From 6000 to the proposed end at 1000 + 199 * 50.
        assert_eq!(
            (plan.first_table_counts, plan.pitch_counts, plan.columns),
            (6_000, (10_950 - 6_000) / 9, 10)
        );
        let back = planned(|r| (r.x_first_mm, r.x_last_mm) = (Some(10.0), Some(-10.0))).unwrap();
        assert_eq!(
            (back.first_table_counts, back.pitch_counts, back.columns),
            (7_000, -50, 41)
        );
        let plan = planned(|r| {
            (r.angle_first_deg, r.angle_last_deg, r.samples) = (
                Some((-0.05_f64).to_degrees()),
                Some(0.05_f64.to_degrees()),
                Some(51),
            );
        })
        .unwrap();
        assert_eq!(
            (
                plan.first_angle_counts,
                plan.angle_step_counts,
                plan.samples
            ),
            (-50, 2, 51)
        );
    }

    #[test]
    fn what_the_scanner_cannot_do_is_refused_with_its_limits() {
        for (result, message) in [
            (
                planned(|r| r.x_last_mm = Some(61.0)),
                "61 mm is beyond the scanner's table, which goes from -60.000 to 60.000 mm",
            ),
            (
                planned(|r| (r.pitch_mm, r.columns) = (Some(1.0), Some(500))),
                "449 mm is beyond the scanner's table",
            ),
            (
                planned(|r| r.pitch_mm = Some(0.001)),
                "the table's finest step is 0.01 mm",
            ),
            (planned(|r| r.pitch_mm = Some(-1.0)), "is not possible"),
            (
                planned(|r| r.columns = Some(2_000)),
                "2000 columns are not possible: this scanner takes 1 to 1000",
            ),
            (
                planned(|r| r.columns = Some(0)),
                "0 columns are not possible",
            ),
            (
                planned(|r| {
                    (r.x_first_mm, r.x_last_mm, r.columns) = (Some(1.0), Some(1.0), Some(5))
                }),
                "closer than the table's counts",
            ),
            (
                planned(|r| r.samples = Some(1_000)),
                "1000 samples in a column are not possible: this scanner takes 2 to 256",
            ),
            (
                planned(|r| r.angle_last_deg = Some(10.0)),
                "10 degrees is beyond the scanner's field of view, which goes from -5.730 to",
            ),
            (
                planned(|r| r.y_first_mm = Some(1.0)),
                "give angle_first_deg and angle_last_deg",
            ),
            (
                planned(|r| r.exposure_us = Some(5)),
                "this scanner takes 10 to 1000 us",
            ),
            (
                planned(|r| r.x_first_mm = Some(f64::NAN)),
                "beyond the scanner's table",
            ),
        ] {
            let error = result.unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
