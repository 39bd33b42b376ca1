//! A section's curve by the paper's Fig. 4.

use nurbs::{BSplineCurve, BandedMatrix, KnotVector};
use range_image::{Cancelled, Monitor};

use super::remove::{Bounded, thinned};
use crate::basis::DEGREE;
use crate::stack::Course;

/// The curve of a section: interpolated, its knots removed as far as the tolerance allows; with the
/// number of control points that is left fitted by least squares, and again with one more until every
/// data point is within the tolerance. `None` where that never is.
pub(super) fn approximated(
    course: &Course,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<BSplineCurve<3>>, Cancelled> {
    let Some(interpolating) = interpolated(course) else {
        return Ok(None);
    };
    let count = course.points.len();
    let mut own = [Bounded {
        curve: interpolating.clone(),
        at: course.at.clone(),
        off_mm: vec![0.0; count],
    }];
    thinned(&mut own, tolerance_mm, monitor)?;
    for controls in own[0].curve.points().len()..count {
        monitor.check()?;
        let Some(curve) = least_squares(course, controls) else {
            continue;
        };
        let places = course.points.iter().zip(&course.at);
        let mut off = places.map(|(place, t)| curve.closest_from(*place, *t).distance);
        if off.all(|off_mm| off_mm <= tolerance_mm) {
            return Ok(Some(curve));
        }
    }
    Ok(Some(interpolating))
}

/// The curve through all data points; knots by averaging (Piegl & Tiller 1997, equation 9.8).
pub(super) fn interpolated(course: &Course) -> Option<BSplineCurve<3>> {
    let at = &course.at;
    let inner =
        (1..at.len() - DEGREE).map(|j| at[j..j + DEGREE].iter().sum::<f64>() / DEGREE as f64);
    let knots = clamped(inner)?;
    fitted(course, knots)
}

/// The curve with so many control points that comes nearest to the data points and has the first and
/// the last (equations 2.2 to 2.5); knots by number (Piegl & Tiller 1997, equation 9.69).
fn least_squares(course: &Course, controls: usize) -> Option<BSplineCurve<3>> {
    let at = &course.at;
    let d = at.len() as f64 / (controls - DEGREE) as f64;
    let inner = (1..controls - DEGREE).map(|j| {
        let place = j as f64 * d;
        let (i, share) = (place as usize, place - place.floor());
        (1.0 - share) * at[i - 1] + share * at[i]
    });
    fitted(course, clamped(inner)?)
}

fn clamped(inner: impl Iterator<Item = f64>) -> Option<KnotVector> {
    let knots = core::iter::repeat_n(0.0, DEGREE + 1).chain(inner);
    let knots = knots.chain(core::iter::repeat_n(1.0, DEGREE + 1));
    KnotVector::new(DEGREE, knots.collect()).ok()
}

/// Least squares over all data points but the first and the last, which the curve has.
fn fitted(course: &Course, knots: KnotVector) -> Option<BSplineCurve<3>> {
    let controls = knots.control_count();
    let [first, .., last] = course.points.as_slice() else {
        return None;
    };
    let free = controls.checked_sub(2)?;
    let mut matrix = BandedMatrix::zero(free, DEGREE);
    let mut sums = vec![[0.0; 3]; free];
    let inner = 1..course.points.len() - 1;
    for (place, t) in course.points[inner.clone()].iter().zip(&course.at[inner]) {
        let basis = knots.basis(*t);
        // What the ends leave (the paper's R).
        let mut rest = *place;
        for k in 0..=DEGREE {
            let end = match basis.first + k {
                0 => first,
                i if i + 1 == controls => last,
                _ => continue,
            };
            (0..3).for_each(|d| rest[d] -= basis.values[k] * end[d]);
        }
        let unknown = |k: usize| (basis.first + k).checked_sub(1).filter(|i| *i < free);
        for a in 0..=DEGREE {
            let Some(row) = unknown(a) else { continue };
            for b in 0..=a {
                if let Some(column) = unknown(b) {
                    matrix.add(row, column, basis.values[a] * basis.values[b]);
                }
            }
            let sum = &mut sums[row];
            (0..3).for_each(|d| sum[d] += basis.values[a] * rest[d]);
        }
    }
    let factor = matrix.cholesky().ok()?;
    let mut points = vec![*first];
    points.extend(factor.solve_points(&sums));
    points.push(*last);
    BSplineCurve::new(knots, points).ok()
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::space::distance;
    use crate::testing::ellipse;

    fn open() -> Course {
        let mut course = ellipse(60.0, 30.0, 0.0, 80);
        course.points.push(course.points[0]);
        course.at.push(1.0);
        course
    }

    #[test]
    fn the_interpolating_curve_has_all_data_points() {
        let course = open();
        let curve = interpolated(&course).unwrap();
        for (place, t) in course.points.iter().zip(&course.at) {
            assert!(distance(curve.evaluate(*t), *place) < 1e-7);
        }
    }

    #[test]
    fn a_wider_tolerance_takes_fewer_control_points_and_none_is_taken_too_many() {
        let course = open();
        let mut before = usize::MAX;
        for tolerance_mm in [0.01, 0.1, 1.0] {
            let curve = approximated(&course, tolerance_mm, &Unmonitored)
                .unwrap()
                .unwrap();
            let count = curve.points().len();
            assert!(count < before);
            before = count;
            for end in [0.0, 1.0] {
                assert!(distance(curve.evaluate(end), course.points[0]) < 1e-12);
            }
        }
    }
}
