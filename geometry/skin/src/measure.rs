//! How far data points are from a surface.

use nurbs::BSplineSurface;
use range_image::Monitor;
use rayon::prelude::*;

use crate::error::SkinError;
use crate::stack::Stack;

/// How near to the seam of a closed surface the other side of it is looked at as well.
const SEAM: f64 = 0.02;

/// A data point and the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Index of its section in the stack.
    pub section: usize,
    /// Where it is, millimetres.
    pub place_mm: [f64; 3],
    /// Parameters of the nearest point of the surface, around and across.
    pub at: [f64; 2],
    /// How far that is, millimetres.
    pub off_mm: f64,
}

/// The distance of each data point from a surface, the nearest point being looked for from where its
/// section has it. `feet[k]` are the parameters around of section `k`.
pub(crate) fn deviations(
    surface: &BSplineSurface,
    stack: &Stack,
    feet: &[Vec<f64>],
    monitor: &dyn Monitor,
) -> Result<Vec<Deviation>, SkinError> {
    let of_section = |section: usize| -> Result<Vec<Deviation>, SkinError> {
        monitor.check()?;
        let height = stack.heights[section];
        let of = |(place, t): (&[f64; 3], &f64)| {
            let mut closest = surface.closest_from(*place, [*t, height]);
            let around = closest.at[0];
            if stack.is_closed && !(SEAM..=1.0 - SEAM).contains(&around) {
                let beyond = if around < 0.5 { 1.0 } else { 0.0 };
                let other = surface.closest_from(*place, [beyond, closest.at[1]]);
                if other.distance < closest.distance {
                    closest = other;
                }
            }
            Deviation {
                section,
                place_mm: *place,
                at: closest.at,
                off_mm: closest.distance,
            }
        };
        let points = stack.courses[section].points.iter();
        Ok(points.zip(&feet[section]).map(of).collect())
    };
    let all: Result<Vec<Vec<Deviation>>, SkinError> = (0..stack.courses.len())
        .into_par_iter()
        .map(of_section)
        .collect();
    Ok(all?.concat())
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::settings::Settings;
    use crate::surface::{Counts, finished};
    use crate::testing::waisted;

    fn found() -> (Stack, BSplineSurface) {
        let settings = Settings::new(0.5);
        let sections = waisted(5, 80);
        let surface = crate::skin(&sections, &settings, &Unmonitored)
            .unwrap()
            .surface;
        (Stack::of(&sections, &settings).unwrap(), surface)
    }

    #[test]
    fn beside_the_seam_the_other_side_of_it_is_looked_at() {
        let (stack, surface) = found();
        // As if all points beside the seam had been found just before it.
        let other = |t: &f64| if *t < 0.015 { 1.0 } else { *t };
        let feet: Vec<Vec<f64>> = stack
            .courses
            .iter()
            .map(|course| course.at.iter().map(other).collect())
            .collect();
        let found = deviations(&surface, &stack, &feet, &Unmonitored).unwrap();
        assert!(found.iter().all(|own| own.off_mm <= 0.5));
        let moved = feet.iter().flatten().filter(|t| **t == 1.0).count();
        assert!(moved >= 5, "{moved}");
    }

    #[test]
    fn no_surface_is_handed_out_that_is_off_by_more_than_the_tolerance() {
        let (stack, surface) = found();
        let feet: Vec<Vec<f64>> = stack
            .courses
            .iter()
            .map(|course| course.at.clone())
            .collect();
        let asked = |tolerance_mm: f64| {
            let counts = Counts {
                of_sections: Vec::new(),
                merged: None,
                around: 0,
                points_around: 0,
                rows: 0,
            };
            let points = (&feet[..], Vec::new());
            finished(
                stack.clone(),
                surface.clone(),
                points,
                counts,
                (tolerance_mm, &Unmonitored),
            )
        };
        assert!(asked(0.5).is_ok());
        let error = asked(1e-3).unwrap_err();
        assert!(matches!(error, SkinError::OutOfReach { reached_mm, .. } if reached_mm > 1e-3));
    }
}
