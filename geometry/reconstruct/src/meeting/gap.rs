//! How far one surface lies above another, and where the two intersect.

use nurbs::PatchSurface;

use crate::assemble::Placement;
use crate::polygon::{minus, norm};

/// Newton steps; surfaces are nearly plane over a pitch.
const STEPS: usize = 8;

/// Off the intersection by less than this, pitches, a place counts as on it.
const CLOSE: f64 = 1e-7;

/// Two surfaces over the same places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap<'a> {
    pub(crate) sides: [&'a PatchSurface; 2],
    pub(crate) placement: Placement,
}

/// What is asked of an intersection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// Farthest from the place where it is looked for, pitches.
    pub(crate) farthest: f64,
    /// Least difference of the slopes of the two surfaces.
    pub(crate) least_bend: f64,
}

impl Gap<'_> {
    /// By how much the first surface is the higher one, millimetres, and the slope of that; the
    /// place is in pitches.
    pub(crate) fn at(&self, place: [f64; 2]) -> (f64, [f64; 2]) {
        let [x, y] = self.placement.to_mm(place);
        let [left, right] = self.sides;
        let difference = |u, v| left.z_partial(x, y, u, v) - right.z_partial(x, y, u, v);
        (difference(0, 0), [difference(1, 0), difference(0, 1)])
    }

    /// The place of the intersection nearest to another one, along the slope of the gap.
    pub(crate) fn nearest(&self, start: [f64; 2], reach: Reach) -> Option<[f64; 2]> {
        let mut place = start;
        for _ in 0..STEPS {
            let (gap_mm, slope) = self.at(place);
            let bend = norm(slope);
            if bend.is_nan() || bend < reach.least_bend {
                return None;
            }
            let step = gap_mm / (bend * self.placement.pitch_mm);
            for d in 0..2 {
                place[d] -= step * slope[d] / bend;
            }
            let moved = norm(minus(place, start));
            if moved.is_nan() || moved > reach.farthest {
                return None;
            }
            if step.abs() < CLOSE {
                return Some(place);
            }
        }
        None
    }
}
