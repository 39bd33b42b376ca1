//! Curves that carry edges.

use core::f64::consts::TAU;

use crate::spline::SplineCurve;
use crate::{Frame, Point, wrapped};

/// A curve in space.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    /// A straight line without ends; its parameter is the distance from a point, millimetres.
    Line {
        /// A point of it.
        point_mm: Point,
        /// Its unit direction.
        along: Point,
    },
    /// A circle or an ellipse; its parameter is the angle from the frame's first axis.
    Ellipse {
        /// Centre, axes and normal.
        frame: Frame,
        /// Half its axes.
        radii_mm: [f64; 2],
    },
    /// A spline.
    Spline(SplineCurve),
}

/// Rounds of Newton's method for the parameter of a point.
const ROUNDS: usize = 20;

impl Curve {
    /// The point at a parameter, and the derivative there.
    #[must_use]
    pub fn at(&self, t: f64) -> (Point, Point) {
        match self {
            Self::Line { point_mm, along } => (point_mm + along * t, *along),
            Self::Ellipse { frame, radii_mm } => {
                let (sine, cosine) = libm::sincos(t);
                let [a, b] = *radii_mm;
                let at = frame.origin_mm + frame.x * (a * cosine) + frame.y * (b * sine);
                (at, frame.y * (b * cosine) - frame.x * (a * sine))
            }
            Self::Spline(spline) => {
                // A closed one goes on from its other end.
                let (first, last) = spline.domain();
                if (first..=last).contains(&t) {
                    spline.at(t)
                } else {
                    spline.at(wrapped(t, first, last - first))
                }
            }
        }
    }

    /// The parameter after which it comes back to where it was.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Line { .. } => None,
            Self::Ellipse { .. } => Some(TAU),
            Self::Spline(spline) => {
                let (first, last) = spline.domain();
                let (from, to) = (spline.at(first).0, spline.at(last).0);
                let size_mm = (spline.at((first + last) / 2.0).0 - from).norm();
                ((to - from).norm() <= 1e-6 * size_mm).then_some(last - first)
            }
        }
    }

    /// The parameters between which it is, if it has ends.
    #[must_use]
    pub(crate) fn domain(&self) -> Option<(f64, f64)> {
        match self {
            Self::Spline(spline) => Some(spline.domain()),
            _ => None,
        }
    }

    /// Parameters at which it may be less smooth, or between which it turns by a right angle at
    /// most, with its ends; for what lies between two parameters.
    pub(crate) fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let (low, high) = (from.min(to), from.max(to));
        let mut breaks = vec![low];
        match self {
            Self::Line { .. } => {}
            Self::Ellipse { .. } => {
                let quarters = ((high - low) / (TAU / 4.0)).ceil().max(1.0);
                let count = quarters as usize;
                breaks.extend((1..count).map(|k| low + (high - low) * k as f64 / quarters));
            }
            Self::Spline(spline) => {
                let width = spline.domain().1 - spline.domain().0;
                let inner = spline.breaks().into_iter();
                // Once round, the knots come again.
                let all = inner.flat_map(|b| [b - width, b, b + width]);
                let mut all: Vec<f64> = all.filter(|b| *b > low && *b < high).collect();
                all.sort_by(f64::total_cmp);
                all.dedup();
                breaks.extend(all);
            }
        }
        breaks.push(high);
        if from > to {
            breaks.reverse();
        }
        breaks
    }

    /// The parameter of the point nearest to another.
    #[must_use]
    pub fn parameter(&self, point_mm: &Point) -> f64 {
        match self {
            Self::Line { point_mm: o, along } => (point_mm - o).dot(along),
            Self::Ellipse { frame, radii_mm } => {
                let [x, y, _] = frame.coordinates(point_mm);
                let angle = libm::atan2(y / radii_mm[1], x / radii_mm[0]);
                self.improved(angle, point_mm)
            }
            Self::Spline(spline) => {
                let off = |t: &f64| (self.at(*t).0 - point_mm).norm_squared();
                let nearest = spline
                    .places()
                    .into_iter()
                    .min_by(|a, b| off(a).total_cmp(&off(b)));
                self.improved(nearest.unwrap_or(spline.domain().0), point_mm)
            }
        }
    }

    /// A parameter led to the nearest point.
    fn improved(&self, mut t: f64, point_mm: &Point) -> f64 {
        for _ in 0..ROUNDS {
            let (at, along) = self.at(t);
            let speed2 = along.norm_squared();
            if speed2 == 0.0 {
                break;
            }
            let step = (point_mm - at).dot(&along) / speed2;
            let mut next = t + step;
            if let Some((first, last)) = self.domain() {
                next = next.clamp(first, last);
            }
            if (next - t).abs() <= 1e-14 * t.abs().max(1.0) {
                return next;
            }
            t = next;
        }
        t
    }
}
