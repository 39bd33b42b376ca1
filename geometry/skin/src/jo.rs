//! The paper's way (Jo, Kwon & Han, section 2): each section by itself, open at its seam, with as
//! many control points as its tolerance takes; then common knots for all, of which those are removed
//! that the tolerance does not need.
//!
//! The paper follows Piegl & Tiller 1997, pp. 405 to 412, and leaves to them what it does not say:
//! chord lengths as parameters, knots by averaging for the interpolation (equation 9.8) and by number
//! for least squares (9.69), and for the removal of knots a bound of the error at each data point,
//! which grows by what each knot removed moves the curve there (A9.8 and A9.9).

mod approximate;
mod remove;

use nurbs::{BSplineCurve, BSplineSurface, KnotVector};
use range_image::Monitor;

use crate::error::SkinError;
use crate::settings::Settings;
use crate::spread::{averaged, column_of};
use crate::stack::{Course, Stack};
use crate::surface::{Counts, Skin, finished};
use approximate::{approximated, interpolated};
use remove::{Bounded, thinned};

/// Knots nearer than this are one.
const SAME_KNOT: f64 = 1e-12;

/// Control points of all curves over the knots of all: more would take gigabytes, and days.
const MOST_NUMBERS: usize = 2_000_000;

/// A section's curves by the paper, open at its seam.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionCurves {
    /// Its data points from its start on, millimetres; the first of a closed section is the last again.
    pub points: Vec<[f64; 3]>,
    /// Through all of them (Fig. 1).
    pub interpolating: BSplineCurve<3>,
    /// With as many control points as the tolerance takes (Fig. 2).
    pub approximating: BSplineCurve<3>,
}

/// The curves of all sections, in the order of their stack: sections 2.1 and 2.2 of the paper, before
/// it makes a surface of them.
pub(crate) fn curves(
    mut stack: Stack,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<SectionCurves>, SkinError> {
    opened(&mut stack);
    let of = |course: &Course| {
        monitor.check()?;
        let undetermined = || SkinError::Undetermined {
            section: course.name.clone(),
        };
        let approximating = approximated(course, tolerance_mm, monitor)?;
        Ok(SectionCurves {
            points: course.points.clone(),
            interpolating: interpolated(course).ok_or_else(undetermined)?,
            approximating: approximating.ok_or_else(undetermined)?,
        })
    };
    stack.courses.iter().map(of).collect()
}

/// The paper's curves end where they begin.
fn opened(stack: &mut Stack) {
    if stack.is_closed {
        for course in &mut stack.courses {
            course.points.extend(course.points.first().copied());
            course.at.push(1.0);
        }
    }
}

pub(crate) fn skin(
    mut stack: Stack,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Skin, SkinError> {
    let tolerance_mm = settings.tolerance_mm;
    opened(&mut stack);
    let mut bounded = Vec::with_capacity(stack.courses.len());
    for (k, course) in stack.courses.iter().enumerate() {
        monitor.check()?;
        let curve = approximated(course, tolerance_mm, monitor)?;
        let curve = curve.ok_or_else(|| SkinError::Undetermined {
            section: course.name.clone(),
        })?;
        bounded.push(bounds(course, curve));
        monitor.progress(0.4 * (k + 1) as f64 / stack.courses.len() as f64);
    }
    let of_sections = bounded
        .iter()
        .map(|own| own.curve.knots().knots().len())
        .collect();
    // The first point, that is the last as well, counts once.
    let repeated = usize::from(stack.is_closed);
    let once = |own: &Bounded| own.off_mm[..own.off_mm.len() - repeated].to_vec();
    let before_mm = bounded.iter().flat_map(once).collect();
    merge(&mut bounded)?;
    let merged = bounded[0].curve.knots().knots().len();
    monitor.progress(0.5);
    thinned(&mut bounded, tolerance_mm, monitor)?;
    monitor.progress(0.8);
    let mut feet: Vec<Vec<f64>> = bounded.iter().map(|own| own.at.clone()).collect();
    let surface = skinned(&bounded, &stack.heights, settings.degree_across);
    let surface = surface.ok_or_else(|| SkinError::Undetermined {
        section: stack.courses[0].name.clone(),
    })?;
    for (course, feet) in stack.courses.iter_mut().zip(&mut feet) {
        course.points.truncate(course.points.len() - repeated);
        feet.truncate(feet.len() - repeated);
    }
    let counts = Counts {
        of_sections,
        merged: Some(merged),
        around: surface.u_knots().knots().len(),
        points_around: surface.u_knots().control_count(),
        rows: surface.v_knots().control_count(),
    };
    let asked = (tolerance_mm, monitor);
    finished(stack, surface, (&feet, before_mm), counts, asked)
}

/// A curve with what its data points are off it.
fn bounds(course: &Course, curve: BSplineCurve<3>) -> Bounded {
    let closest = course
        .points
        .iter()
        .zip(&course.at)
        .map(|(place, t)| curve.closest_from(*place, *t));
    let (at, off_mm) = closest
        .map(|closest| (closest.at, closest.distance))
        .unzip();
    Bounded { curve, at, off_mm }
}

/// Brings all curves to the knots that any of them has. Knots that are one but for rounding become
/// one, so that they can be removed again.
fn merge(all: &mut [Bounded]) -> Result<(), SkinError> {
    let inner = |knots: &KnotVector| -> Vec<f64> {
        knots.knots()[knots.degree() + 1..knots.control_count()].to_vec()
    };
    let mut merged: Vec<f64> = all
        .iter()
        .flat_map(|own| inner(own.curve.knots()))
        .collect();
    merged.sort_by(f64::total_cmp);
    merged.dedup_by(|a, b| (*a - *b).abs() <= SAME_KNOT);
    let numbers = merged.len().saturating_mul(all.len());
    if numbers > MOST_NUMBERS {
        return Err(SkinError::TooMany {
            knots: merged.len(),
            sections: all.len(),
        });
    }
    for own in all {
        let knots = own.curve.knots();
        let (degree, (first, last)) = (knots.degree(), knots.domain());
        let one = |knot: f64| {
            let after = merged.partition_point(|m| *m < knot - SAME_KNOT);
            merged.get(after).copied().unwrap_or(knot)
        };
        let snapped: Vec<f64> = inner(knots).into_iter().map(one).collect();
        let missing: Vec<f64> = merged
            .iter()
            .copied()
            .filter(|knot| !snapped.contains(knot))
            .collect();
        let ends = |end: f64| core::iter::repeat_n(end, degree + 1);
        let all_knots = ends(first).chain(snapped).chain(ends(last)).collect();
        let finer = KnotVector::new(degree, all_knots)
            .ok()
            .and_then(|knots| BSplineCurve::new(knots, own.curve.points().to_vec()).ok())
            .and_then(|curve| curve.with_knots(&missing).ok());
        if let Some(finer) = finer {
            own.curve = finer;
        }
    }
    Ok(())
}

/// The surface through the curves, which have common knots.
fn skinned(all: &[Bounded], heights: &[f64], degree: usize) -> Option<BSplineSurface> {
    let across: KnotVector = averaged(heights, degree)?;
    let knots = all.first()?.curve.knots().clone();
    let mut points = Vec::new();
    for i in 0..knots.control_count() {
        let column: Vec<[f64; 3]> = all.iter().map(|own| own.curve.points()[i]).collect();
        points.extend(column_of(&across, heights, &column)?);
    }
    BSplineSurface::new(knots, across, points).ok()
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use crate::settings::{Method, Settings};
    use crate::testing::waisted;
    use crate::{section_curves, skin};

    fn settings(tolerance_mm: f64) -> Settings {
        Settings {
            method: Method::Jo,
            ..Settings::new(tolerance_mm)
        }
    }

    #[test]
    fn knots_are_merged_and_removed_and_the_tolerance_is_held() {
        let sections = waisted(9, 90);
        let mut before = usize::MAX;
        for tolerance_mm in [0.3, 3.0] {
            let skin = skin(&sections, &settings(tolerance_mm), &Unmonitored).unwrap();
            assert!(skin.most_mm() <= tolerance_mm, "{}", skin.most_mm());
            let counts = &skin.counts;
            assert_eq!((counts.of_sections.len(), counts.rows), (9, 9));
            assert!(counts.merged.unwrap() > counts.around);
            assert_eq!(counts.around, counts.points_around + 4);
            assert!(counts.points() < before);
            before = counts.points();
            // It ends where it begins.
            for k in 0..=10 {
                let v = 0.1 * f64::from(k);
                let (start, end) = (skin.surface.evaluate(0.0, v), skin.surface.evaluate(1.0, v));
                assert!(crate::space::distance(start, end) < 1e-9);
            }
        }
    }

    #[test]
    fn a_section_has_a_curve_through_all_its_points_and_one_near_them() {
        let tolerance_mm = 0.3;
        let all = section_curves(&waisted(3, 90), tolerance_mm, &Unmonitored).unwrap();
        assert_eq!(all.len(), 3);
        for own in &all {
            // The first point is the last again.
            assert_eq!((own.points.len(), own.points[0]), (91, own.points[90]));
            let most = |curve: &nurbs::BSplineCurve<3>| {
                let off_mm = own.points.iter().map(|p| curve.closest(*p).distance);
                off_mm.fold(0.0, f64::max)
            };
            assert!(
                most(&own.interpolating) < 1e-6,
                "{}",
                most(&own.interpolating)
            );
            assert!(most(&own.approximating) <= tolerance_mm);
            let [many, few] = [&own.interpolating, &own.approximating].map(|c| c.points().len());
            assert!(2 * few < many, "{few} {many}");
        }
    }
}
