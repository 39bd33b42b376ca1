//! Closed outlines of lines and arcs, and what moves them.

use std::f64::consts::FRAC_PI_2;

use crate::error::OutlineError;
use crate::plan::{
    Meeting, P2, Piece, Support, add, angle, area, cross, distance, dot, left, norm, polar, scale,
    sub, unit,
};

/// Ends that meet are as near as this, millimetres.
const JOINT_MM: f64 = 1e-6;
/// Least length of a piece, radius of an arc and extent of an outline, millimetres.
pub const LEAST_MM: f64 = 0.01;
/// Sine of the angle below which pieces that meet go on in the same direction.
const SMOOTH: f64 = 1e-5;

/// A closed loop of lines and arcs in the plan, counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pieces: Vec<Piece>,
}

impl Outline {
    /// An outline from its pieces in either sense; millimetres.
    ///
    /// # Errors
    /// [`OutlineError`] where pieces do not follow each other, are shorter than [`LEAST_MM`], or
    /// enclose nothing.
    pub fn new(pieces: Vec<Piece>) -> Result<Self, OutlineError> {
        if pieces.len() < 2 {
            return Err(OutlineError::TooFew {
                given: pieces.len(),
            });
        }
        for (index, piece) in pieces.iter().enumerate() {
            let next = pieces[(index + 1) % pieces.len()];
            let mut numbers = vec![piece.from(), piece.to()];
            if let Piece::Arc {
                from, to, center, ..
            } = *piece
            {
                numbers.push(center);
                let gap_mm = (distance(from, center) - distance(to, center)).abs();
                if gap_mm.is_nan() || gap_mm > JOINT_MM {
                    return Err(OutlineError::Arc { index, gap_mm });
                }
            }
            if !numbers.iter().flatten().all(|x| x.abs() < 1e6) {
                return Err(OutlineError::Number { index });
            }
            let gap_mm = distance(piece.to(), next.from());
            if gap_mm > JOINT_MM {
                return Err(OutlineError::Open { index, gap_mm });
            }
            let length_mm = piece.length();
            if length_mm < LEAST_MM {
                return Err(OutlineError::Short { index, length_mm });
            }
        }
        let enclosed = area(&pieces);
        if enclosed.abs() < LEAST_MM * LEAST_MM {
            return Err(OutlineError::Flat);
        }
        Ok(Self {
            pieces: if enclosed > 0.0 {
                pieces
            } else {
                pieces.iter().rev().map(Piece::reversed).collect()
            },
        })
    }

    /// A polygon from its corners, millimetres, in either sense.
    ///
    /// # Errors
    /// As of [`Outline::new`].
    pub fn polygon(corners: &[[f64; 2]]) -> Result<Self, OutlineError> {
        let next = corners.iter().cycle().skip(1);
        let pieces = corners.iter().zip(next);
        Self::new(
            pieces
                .map(|(&from, &to)| Piece::Line { from, to })
                .collect(),
        )
    }

    /// A rectangle around its middle: length along a direction (an angle from x), width across it,
    /// corners of a radius or sharp ones (0); millimetres and radians.
    ///
    /// # Errors
    /// [`OutlineError::Radius`] where the corners are wider than the rectangle; else as of
    /// [`Outline::new`].
    pub fn rectangle(
        center: [f64; 2],
        length_mm: f64,
        width_mm: f64,
        angle_rad: f64,
        corner_radius_mm: f64,
    ) -> Result<Self, OutlineError> {
        let (a, b, r) = (0.5 * length_mm, 0.5 * width_mm, corner_radius_mm);
        if r < 0.0 || r > a.min(b) + 1e-9 {
            return Err(OutlineError::Radius { radius_mm: r });
        }
        let (x, y) = (polar(angle_rad), left(polar(angle_rad)));
        let place = |p: P2| add(center, add(scale(x, p[0]), scale(y, p[1])));
        if r < LEAST_MM {
            return Self::polygon(&[[-a, -b], [a, -b], [a, b], [-a, b]].map(place));
        }
        let mut pieces = Vec::new();
        // Corners counter-clockwise from the right at the bottom; each with the side before it.
        let corners = [[a, -b], [a, b], [-a, b], [-a, -b]];
        let ends = |k: usize| {
            let [sx, sy] = corners[k].map(f64::signum);
            let center = [corners[k][0] - sx * r, corners[k][1] - sy * r];
            let (on_x, on_y) = (
                [center[0], center[1] + sy * r],
                [center[0] + sx * r, center[1]],
            );
            // Corners are entered along x at the first and third, along y at the others.
            let (enter, leave) = if k == 0 || k == 2 {
                (on_x, on_y)
            } else {
                (on_y, on_x)
            };
            (place(center), place(enter), place(leave))
        };
        for k in 0..4 {
            let (center, enter, leave) = ends(k);
            let from = ends((k + 3) % 4).2;
            if distance(from, enter) > LEAST_MM {
                pieces.push(Piece::Line { from, to: enter });
            }
            pieces.push(Piece::Arc {
                from: enter,
                to: leave,
                center,
                ccw: true,
            });
        }
        // Without sides of a length, corners meet as near as their sides are short.
        let count = pieces.len();
        for k in 0..count {
            let next = pieces[(k + 1) % count].from();
            let (Piece::Line { to, .. } | Piece::Arc { to, .. }) = &mut pieces[k];
            if distance(*to, next) < 1e-9 {
                *to = next;
            }
        }
        Self::new(pieces)
    }

    /// A slot with round ends around two centres, millimetres.
    ///
    /// # Errors
    /// As of [`Outline::new`].
    pub fn obround(a: [f64; 2], b: [f64; 2], width_mm: f64) -> Result<Self, OutlineError> {
        let middle = scale(add(a, b), 0.5);
        let along = sub(b, a);
        let turn = libm::atan2(along[1], along[0]);
        let r = 0.5 * width_mm;
        Self::rectangle(middle, norm(along) + width_mm, width_mm, turn, r)
    }

    /// A circle, millimetres.
    ///
    /// # Errors
    /// As of [`Outline::new`].
    pub fn circle(center: [f64; 2], radius_mm: f64) -> Result<Self, OutlineError> {
        let ends = [[radius_mm, 0.0], [-radius_mm, 0.0]].map(|end| add(center, end));
        let half = |from, to| Piece::Arc {
            from,
            to,
            center,
            ccw: true,
        };
        Self::new(vec![half(ends[0], ends[1]), half(ends[1], ends[0])])
    }

    /// Its pieces, counter-clockwise.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The area within, square millimetres.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        area(&self.pieces)
    }

    /// Centre and radius if it is a circle.
    #[must_use]
    pub fn as_circle(&self) -> Option<([f64; 2], f64)> {
        let Support::Circle { c, r } = self.pieces[0].support() else {
            return None;
        };
        let same = |piece: &Piece| match piece.support() {
            Support::Circle { c: d, r: s } => distance(c, d) < JOINT_MM && (r - s).abs() < JOINT_MM,
            Support::Line { .. } => false,
        };
        self.pieces.iter().all(same).then_some((c, r))
    }

    /// Least and greatest x and y.
    pub(crate) fn bounds(&self) -> [P2; 2] {
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        let mut take = |p: P2| {
            for k in 0..2 {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
        };
        for piece in &self.pieces {
            take(piece.from());
            if let (Support::Circle { c, r }, sweep) = (piece.support(), piece.sweep()) {
                let from = angle(sub(piece.from(), c));
                for quarter in 0..4 {
                    let at = FRAC_PI_2 * f64::from(quarter);
                    let turn = crate::plan::positive((at - from) * sweep.signum());
                    if turn < sweep.abs() {
                        take(add(c, scale(polar(at), r)));
                    }
                }
            }
        }
        bounds
    }

    /// How piece `k` goes on from the one before it.
    pub(crate) fn joint(&self, k: usize) -> Joint {
        let count = self.pieces.len();
        let (before, after) = (self.pieces[(k + count - 1) % count], self.pieces[k]);
        let (a, b) = (before.tangent(1.0), after.tangent(0.0));
        let sine = cross(a, b);
        if sine.abs() < SMOOTH && dot(a, b) > 0.0 {
            return Joint::Smooth;
        }
        match (before, after) {
            (Piece::Line { .. }, Piece::Line { .. }) if sine.abs() > 0.02 => Joint::Corner,
            _ => Joint::Other,
        }
    }

    /// Where the pieces of the outline begin once it is moved outwards by a distance (inwards if
    /// negative), millimetres; `None` where a joint has no such place.
    pub(crate) fn moved_joints(&self, out_mm: f64) -> Option<Vec<P2>> {
        let count = self.pieces.len();
        (0..count)
            .map(|k| {
                let (before, after) = (self.pieces[(k + count - 1) % count], self.pieces[k]);
                let at = after.from();
                let right = scale(left(after.tangent(0.0)), -1.0);
                let beside = add(at, scale(right, out_mm));
                if self.joint(k) == Joint::Smooth {
                    return Some(beside);
                }
                let (a, b) = (moved(&before, out_mm)?, moved(&after, out_mm)?);
                let nearest = match a.meet(&b) {
                    Meeting::Apart => None,
                    Meeting::Touch { at, .. } => Some(at),
                    Meeting::Points(points) => points
                        .into_iter()
                        .min_by(|p, q| distance(*p, at).total_cmp(&distance(*q, at))),
                };
                nearest.filter(|p| distance(*p, at) < 20.0 * out_mm.abs())
            })
            .collect()
    }

    /// The outline moved outwards; `None` where a piece would vanish.
    pub(crate) fn moved(&self, out_mm: f64) -> Option<Self> {
        let joints = self.moved_joints(out_mm)?;
        let count = self.pieces.len();
        let pieces: Option<Vec<Piece>> = (0..count)
            .map(|k| moved_piece(&self.pieces[k], out_mm, joints[k], joints[(k + 1) % count]))
            .collect();
        Self::new(pieces?).ok()
    }

    /// The outline with lines and circles replaced by others that were there before within a
    /// tolerance. Arcs between lines that they touch follow the lines.
    pub(crate) fn snapped(&self, earlier: &[Piece], tolerance_mm: f64) -> Option<Self> {
        if let Some((c, r)) = self.as_circle() {
            let near = earlier.iter().find_map(|piece| match piece.support() {
                Support::Circle { c: d, r: s }
                    if distance(c, d) < tolerance_mm && (r - s).abs() < tolerance_mm =>
                {
                    Some((d, s))
                }
                _ => None,
            });
            let (c, r) = near?;
            return Self::circle(c, r).ok();
        }
        let count = self.pieces.len();
        let mut is_changed = false;
        let supports: Vec<Support> = self
            .pieces
            .iter()
            .map(|piece| {
                let found = earlier
                    .iter()
                    .find(|other| aligned(piece, other, tolerance_mm));
                is_changed |= found.is_some();
                found.map_or_else(|| piece.support(), |other| same_way(other, piece))
            })
            .collect();
        if !is_changed {
            return None;
        }
        let is_line = |k: usize| matches!(self.pieces[k % count], Piece::Line { .. });
        let mut supports = supports;
        for k in 0..count {
            if is_line(k) {
                continue;
            }
            // What is not a line follows the lines before and after it, or nothing moves.
            let (before, after) = ((k + count - 1) % count, (k + 1) % count);
            let smooth = [k, after].map(|j| self.joint(j) == Joint::Smooth);
            if smooth == [false; 2] {
                continue;
            }
            if !(is_line(before) && is_line(after) && smooth == [true; 2]) {
                return None;
            }
            supports[k] = blend(&self.pieces[k], supports[before], supports[after])?;
        }
        let joints: Option<Vec<P2>> = (0..count)
            .map(|k| {
                let at = self.pieces[k].from();
                let (a, b) = (supports[(k + count - 1) % count], supports[k]);
                if self.joint(k) == Joint::Smooth {
                    let ((Support::Line { p, d }, Support::Circle { c, .. })
                    | (Support::Circle { c, .. }, Support::Line { p, d })) = (a, b)
                    else {
                        return (a == b).then(|| a.at(a.parameter(at)));
                    };
                    return Some(add(p, scale(d, dot(sub(c, p), d))));
                }
                let points = match a.meet(&b) {
                    Meeting::Apart => return None,
                    Meeting::Touch { at, .. } => vec![at],
                    Meeting::Points(points) => points,
                };
                points
                    .into_iter()
                    .min_by(|p, q| distance(*p, at).total_cmp(&distance(*q, at)))
                    .filter(|p| distance(*p, at) < 20.0 * tolerance_mm)
            })
            .collect();
        let joints = joints?;
        let pieces: Option<Vec<Piece>> = (0..count)
            .map(|k| {
                between(
                    &self.pieces[k],
                    supports[k],
                    joints[k],
                    joints[(k + 1) % count],
                )
            })
            .collect();
        Self::new(pieces?).ok()
    }
}

/// How two pieces meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Joint {
    /// The second goes on in the direction of the first.
    Smooth,
    /// Two lines at an angle.
    Corner,
    /// Anything else.
    Other,
}

/// The support of a piece that is moved outwards.
fn moved(piece: &Piece, out_mm: f64) -> Option<Support> {
    match (*piece, piece.support()) {
        (Piece::Line { .. }, Support::Line { p, d }) => Some(Support::Line {
            p: sub(p, scale(left(d), out_mm)),
            d,
        }),
        (Piece::Arc { ccw, .. }, Support::Circle { c, r }) => {
            let r = if ccw { r + out_mm } else { r - out_mm };
            (r > LEAST_MM).then_some(Support::Circle { c, r })
        }
        _ => None,
    }
}

/// A piece that is moved outwards, between its new ends; `None` if it would vanish or turn round.
pub(crate) fn moved_piece(piece: &Piece, out_mm: f64, from: P2, to: P2) -> Option<Piece> {
    between(piece, moved(piece, out_mm)?, from, to)
}

fn between(piece: &Piece, support: Support, from: P2, to: P2) -> Option<Piece> {
    let new = match (*piece, support) {
        (Piece::Line { .. }, _) => {
            let along = dot(sub(to, from), piece.tangent(0.5));
            (along > LEAST_MM).then_some(Piece::Line { from, to })?
        }
        (Piece::Arc { ccw, .. }, Support::Circle { c, .. }) => Piece::Arc {
            from,
            to,
            center: c,
            ccw,
        },
        _ => return None,
    };
    let turned = new.sweep().abs() / piece.sweep().abs().max(1e-9);
    let is_line = matches!(piece, Piece::Line { .. });
    (is_line || (0.5..2.0).contains(&turned)).then_some(new)
}

/// Both lie on one line, or on one circle, within a tolerance.
fn aligned(piece: &Piece, other: &Piece, tolerance_mm: f64) -> bool {
    match (piece.support(), other.support()) {
        (a @ Support::Line { .. }, b @ Support::Line { .. }) => {
            let (Support::Line { p, d }, Support::Line { d: e, .. }) = (b, a) else {
                return false;
            };
            // Only the new piece moves, so only its ends must be near; and no farther than its
            // own length from the other's.
            let along = |q: P2| dot(sub(q, p), d);
            let (mut own, mut its) = (
                [piece.from(), piece.to()].map(along),
                [other.from(), other.to()].map(along),
            );
            own.sort_by(f64::total_cmp);
            its.sort_by(f64::total_cmp);
            let reach = piece.length().max(other.length());
            let is_near = own[0] < its[1] + reach && its[0] < own[1] + reach;
            let ends = [piece.from(), piece.to()];
            is_near
                && cross(d, e).abs() < 0.02
                && ends.iter().all(|&end| b.distance(end) < tolerance_mm)
        }
        _ => false,
    }
}

/// The other's line, run in the piece's direction.
fn same_way(other: &Piece, piece: &Piece) -> Support {
    match other.support() {
        Support::Line { p, d } if dot(d, piece.tangent(0.5)) < 0.0 => Support::Line {
            p,
            d: scale(d, -1.0),
        },
        support => support,
    }
}

/// The circle of an arc that touches two lines, which have moved.
fn blend(arc: &Piece, before: Support, after: Support) -> Option<Support> {
    let (Support::Line { p, d }, Support::Line { p: q, d: e }) = (before, after) else {
        return None;
    };
    let (Piece::Arc { ccw, .. }, Support::Circle { c, r }) = (*arc, arc.support()) else {
        return None;
    };
    let side = if ccw { 1.0 } else { -1.0 };
    if cross(d, e).abs() < 0.02 {
        // A half circle: as wide as the lines are apart, half way between them.
        let r = 0.5 * cross(d, sub(q, p)).abs();
        let foot = add(p, scale(d, dot(sub(c, p), d)));
        let c = add(foot, scale(left(d), side * r));
        return (r > LEAST_MM && cross(d, e).abs() < 1e-9).then_some(Support::Circle { c, r });
    }
    let shifted = |p: P2, d: P2| Support::Line {
        p: add(p, scale(left(d), side * r)),
        d,
    };
    match shifted(p, d).meet(&shifted(q, e)) {
        Meeting::Points(points) => points.first().map(|&c| Support::Circle { c, r }),
        _ => None,
    }
}

/// The unit direction out of the outline at a part of a piece.
pub(crate) fn outward(piece: &Piece, part: f64) -> P2 {
    unit(scale(left(piece.tangent(part)), -1.0))
}
