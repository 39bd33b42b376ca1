//! How far one surface lies above another, and where the two intersect or touch.

use nurbs::PatchSurface;

use crate::assemble::Placement;
use crate::model::SPACE_CURVE_TOLERANCE_MM;
use crate::polygon::{dot, minus, norm};

/// Newton steps; surfaces are nearly plane over a pitch.
const STEPS: usize = 8;

/// Off the intersection by less than this, pitches, a place counts as on it; and off the line of
/// touch, which second derivatives lead to.
const CLOSE: f64 = 1e-7;
const CLOSE_TO_TOUCH: f64 = 1e-3;

/// How much the gap of surfaces that touch has to bend across the line where they do, in slopes from
/// pitch to pitch: what hardly bends is touched anywhere.
const LEAST_CURVATURE: f64 = 0.005;

/// Slope of the gap that stands for one whose slopes vanish. Distances from the line count as gaps
/// on it, beside those of surfaces that intersect.
const STAND_IN: f64 = 0.1;

/// How near to the line of touch is on it, millimetres.
const ON_TOUCH_MM: f64 = 5e-3;

/// How far apart surfaces are at most that lie on each other, millimetres.
const BLUNT_MM: f64 = 2e-3;

/// Which line of two surfaces is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Line {
    /// That in which they intersect.
    Intersection,
    /// The same of surfaces that hardly bend there.
    Faint,
    /// That along which they are nearest to each other or farthest into each other, and have one
    /// tangent plane: where a fillet ends.
    Touch,
}

/// Two surfaces over the same places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap<'a> {
    pub(crate) sides: [&'a PatchSurface; 2],
    pub(crate) placement: Placement,
    pub(crate) line: Line,
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
    /// What vanishes on the line, millimetres, and the slope of that; the place is in pitches. For
    /// an intersection it is by how much the first surface is the higher one. Not a number where
    /// surfaces touch nowhere in particular.
    pub(crate) fn at(&self, place: [f64; 2]) -> (f64, [f64; 2]) {
        match self.line {
            Line::Intersection | Line::Faint => self.height(place),
            Line::Touch => self.touch(place),
        }
    }

    /// By how much the first surface is the higher one, millimetres, and the slope of that.
    pub(crate) fn height(&self, place: [f64; 2]) -> (f64, [f64; 2]) {
        let difference = self.difference(place);
        (difference(0, 0), [difference(1, 0), difference(0, 1)])
    }

    /// Derivatives of that, of any orders along x and y.
    fn difference(&self, place: [f64; 2]) -> impl Fn(usize, usize) -> f64 {
        let [x, y] = self.placement.to_mm(place);
        let [left, right] = self.sides;
        move |u, v| left.z_partial(x, y, u, v) - right.z_partial(x, y, u, v)
    }

    /// How far a place is from the line where the gap is least or greatest across it, as a gap with
    /// the slope that stands in.
    fn touch(&self, place: [f64; 2]) -> (f64, [f64; 2]) {
        let difference = self.difference(place);
        let [a, b, c] = [difference(2, 0), difference(1, 1), difference(0, 2)];
        // The direction in which the gap bends most, and how much.
        let (middle, half) = ((a + c) / 2.0, (a - c) / 2.0);
        let radius = libm::hypot(half, b).copysign(middle);
        let curvature = middle + radius;
        let bend = curvature.abs() * self.placement.pitch_mm;
        if bend.is_nan() || bend < LEAST_CURVATURE {
            return (f64::NAN, [f64::NAN; 2]);
        }
        let across = if (half >= 0.0) == (radius >= 0.0) {
            [half + radius, b]
        } else {
            [b, radius - half]
        };
        let across = across.map(|c| c / norm(across));
        let slope = dot([difference(1, 0), difference(0, 1)], across);
        (STAND_IN * slope / curvature, across.map(|c| STAND_IN * c))
    }

    /// How far off a place may be that lies on the line, as [`Gap::at`] tells it.
    pub(crate) fn tolerance_mm(&self) -> f64 {
        match self.line {
            Line::Intersection | Line::Faint => SPACE_CURVE_TOLERANCE_MM,
            Line::Touch => STAND_IN * ON_TOUCH_MM,
        }
    }

    /// Whether the line in which surfaces intersect runs out at a place, since they lie on each other
    /// there and do not bend: so do two fillets that meet in a corner of the face that both touch.
    pub(crate) fn is_blunt(&self, place: [f64; 2], reach: Reach) -> bool {
        let (gap_mm, slope) = self.height(place);
        let is_flat = gap_mm.abs() <= BLUNT_MM && norm(slope) < reach.least_bend;
        self.line == Line::Intersection && is_flat
    }

    /// The place of the line nearest to another one, along the slope of what vanishes on it.
    pub(crate) fn nearest(&self, start: [f64; 2], reach: Reach) -> Option<[f64; 2]> {
        let close = match self.line {
            Line::Intersection | Line::Faint => CLOSE,
            Line::Touch => CLOSE_TO_TOUCH,
        };
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
            if step.abs() < close {
                return Some(place);
            }
        }
        None
    }
}
