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
