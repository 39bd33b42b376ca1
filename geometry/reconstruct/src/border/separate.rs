//! Lines and curves that keep the nodes apart.
//!
//! The least-squares line of a digital straight border is near the truth but passes some
//! nodes on the wrong side, and each of those counts with its full value in a comparison
//! of images. Among the lines near it there mostly is one that separates all nodes.

use nurbs::BandedMatrix;

use crate::polygon::{dot, minus, norm};

/// A line through a point, along a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) point: [f64; 2],
    pub(crate) along: [f64; 2],
}

/// Nodes lie this far from the middle of their crack, less a margin, pitches.
const REACH: f64 = 0.45;

/// Weight of nodes on the right side against those on the wrong one.
const EASE: f64 = 0.01;

/// Nodes on the wrong side by more than about this count as mistakes of the labels.
const SOFT: f64 = 0.4;

/// Rounds of reweighting.
const ROUNDS: usize = 20;

/// The line moved to the side of its middles on which it separates the most nodes.
///
/// A middle has a whole coordinate across its crack's direction: the two nodes that the
/// crack parts lie half a pitch to either side, along the other coordinate.
pub(crate) fn separating(middles: &[[f64; 2]], line: Line) -> Line {
    let mut best = (wrong(middles, &line), line);
    let mut current = line;
    for _ in 0..ROUNDS {
        if best.0 == 0 {
            break;
        }
        let Some(next) = moved(middles, &current) else {
            break;
        };
        current = next;
        let count = wrong(middles, &current);
        if count < best.0 {
            best = (count, current);
        }
    }
    best.1
}

/// Half a pitch along the crack's direction, seen across a line with this unit vector.
fn room(middle: [f64; 2], along: [f64; 2], reach: f64) -> f64 {
    let parts_columns = (middle[0] - middle[0].round()).abs() > 0.25;
    reach
        * if parts_columns {
            along[1].abs()
        } else {
            along[0].abs()
        }
}

/// Distance from the line and how much of it keeps both nodes on their sides.
fn offset(middle: [f64; 2], line: &Line, reach: f64) -> (f64, f64) {
    let normal = [-line.along[1], line.along[0]];
    (
        dot(normal, minus(middle, line.point)),
        room(middle, line.along, reach),
    )
}

/// Weight of a middle at a distance from the line, and by how much to move there.
fn pull(off: f64, room: f64) -> (f64, f64) {
    let excess = off.abs() - room;
    if excess > 0.0 {
        (
            1.0 / (1.0 + (excess / SOFT) * (excess / SOFT)),
            excess.copysign(off),
        )
    } else {
        (EASE, 0.0)
    }
}

/// True when the line leaves one of the two nodes that a crack parts on the wrong side.
pub(crate) fn is_wrong(middle: [f64; 2], line: &Line) -> bool {
    let (off, room) = offset(middle, line, 0.5);
    off.abs() >= room
}

fn wrong(middles: &[[f64; 2]], line: &Line) -> usize {
    middles.iter().filter(|m| is_wrong(**m, line)).count()
}

/// One round of reweighted least squares over shift and turn.
fn moved(middles: &[[f64; 2]], line: &Line) -> Option<Line> {
    let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
    for &m in middles {
        let (off, room) = offset(m, line, REACH);
        let (weight, target) = pull(off, room);
        let row = [1.0, dot(line.along, minus(m, line.point))];
        for i in 0..2 {
            for j in 0..2 {
                a[i][j] += weight * row[i] * row[j];
            }
            b[i] += weight * row[i] * target;
        }
    }
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    if det <= 1e-12 * a[0][0] * a[1][1] {
        return None;
    }
    let shift = (a[1][1] * b[0] - a[0][1] * b[1]) / det;
    let turn = (a[0][0] * b[1] - a[1][0] * b[0]) / det;
    let (sin, cos) = libm::sincos(libm::atan(turn));
    let [ux, uy] = line.along;
    Some(Line {
        point: [line.point[0] - shift * uy, line.point[1] + shift * ux],
        along: [cos * ux - sin * uy, sin * ux + cos * uy],
    })
}

/// A cubic curve over 0..=1: coefficients of x and of y in ascending powers.
pub(crate) type Cubic = [[f64; 4]; 2];

/// The same for a cubic, `shares[k]` being the parameter of middle `k`.
pub(crate) fn separating_cubic(middles: &[[f64; 2]], shares: &[f64], cubic: Cubic) -> Cubic {
    let count = |c: &Cubic| {
        let samples = middles.iter().zip(shares);
        samples
            .filter(|(m, t)| is_wrong(**m, &tangent_line(c, **t)))
            .count()
    };
    let mut best = (count(&cubic), cubic);
    let mut current = cubic;
    for _ in 0..ROUNDS {
        if best.0 == 0 {
            break;
        }
        let Some(next) = moved_cubic(middles, shares, &current) else {
            break;
        };
        current = next;
        let wrong = count(&current);
        if wrong < best.0 {
            best = (wrong, current);
        }
    }
    best.1
}

fn powers(t: f64) -> [f64; 4] {
    [1.0, t, t * t, t * t * t]
}

/// The tangent at a parameter.
fn tangent_line(cubic: &Cubic, t: f64) -> Line {
    let slopes = [0.0, 1.0, 2.0 * t, 3.0 * t * t];
    let sum = |c: &[f64; 4], p: &[f64; 4]| c.iter().zip(p).map(|(a, b)| a * b).sum::<f64>();
    let along = cubic.map(|c| sum(&c, &slopes));
    let length = norm(along).max(1e-12);
    Line {
        point: cubic.map(|c| sum(&c, &powers(t))),
        along: along.map(|a| a / length),
    }
}

/// One round of reweighted least squares over the eight coefficients.
fn moved_cubic(middles: &[[f64; 2]], shares: &[f64], cubic: &Cubic) -> Option<Cubic> {
    let mut matrix = BandedMatrix::zero(8, 7);
    let mut rhs = [0.0; 8];
    for (&m, &t) in middles.iter().zip(shares) {
        let line = tangent_line(cubic, t);
        let (off, room) = offset(m, &line, REACH);
        let (weight, target) = pull(off, room);
        let normal = [-line.along[1], line.along[0]];
        // Across the curve as for a line; along it, points stay where they are.
        for (direction, weight, target) in [(normal, weight, target), (line.along, EASE, 0.0)] {
            let p = powers(t);
            let row: [f64; 8] = core::array::from_fn(|k| direction[k / 4] * p[k % 4]);
            for i in 0..8 {
                for j in 0..=i {
                    matrix.add(i, j, weight * row[i] * row[j]);
                }
                rhs[i] += weight * row[i] * target;
            }
        }
    }
    matrix.cholesky().ok()?.solve(&mut rhs);
    let mut next = *cubic;
    for (k, by) in rhs.into_iter().enumerate() {
        next[k / 4][k % 4] += by;
    }
    Some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digital_line_is_separated_from_a_bad_start() {
        let mut worst_start = 0;
        for step in 0..30 {
            let (slope, rise) = (0.033 * f64::from(step), 0.37);
            let height = |i: f64| (slope * i + rise).floor();
            let mut middles = Vec::new();
            for i in 0..120 {
                let i = f64::from(i);
                middles.push([i, height(i) + 0.5]);
                if height(i + 1.0) > height(i) {
                    middles.push([i + 0.5, height(i) + 1.0]);
                }
            }
            let (sin, cos) = libm::sincos(libm::atan(slope) + 0.004);
            let start = Line {
                point: [60.0, 60.0 * slope + 0.7],
                along: [cos, sin],
            };
            worst_start = worst_start.max(wrong(&middles, &start));
            let line = separating(&middles, start);
            assert!(
                wrong(&middles, &line) <= 2,
                "slope {slope}: {}",
                wrong(&middles, &line)
            );
        }
        assert!(worst_start > 20, "{worst_start}");
    }

    #[test]
    fn a_digital_arc_is_separated() {
        let (radius, centre) = (60.0, [0.3, -0.2]);
        let inside = |c: f64, r: f64| norm([c - centre[0], r - centre[1]]) < radius;
        // Middles of the cracks around the upper right eighths, in order of their angle.
        let mut middles = Vec::new();
        for c in 10..60 {
            for r in 10..60 {
                let (c, r) = (f64::from(c), f64::from(r));
                for (dc, dr) in [(1.0, 0.0), (0.0, 1.0)] {
                    if inside(c, r) && !inside(c + dc, r + dr) {
                        middles.push([c + 0.5 * dc, r + 0.5 * dr]);
                    }
                }
            }
        }
        middles.sort_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
        let angle = |m: &[f64; 2]| libm::atan2(m[1], m[0]);
        let (first, last) = (angle(&middles[0]), angle(&middles[middles.len() - 1]));
        let shares: Vec<f64> = middles
            .iter()
            .map(|m| (angle(m) - first) / (last - first))
            .collect();
        // A cubic through four points of a circle too large by 0.4.
        let point = |k: f64| {
            let (sin, cos) = libm::sincos(first + (last - first) * k / 3.0);
            [
                centre[0] + (radius + 0.4) * cos,
                centre[1] + (radius + 0.4) * sin,
            ]
        };
        let four = [0.0, 1.0, 2.0, 3.0].map(point);
        let start = [0, 1].map(|d| nurbs::cubic_through_thirds(four.map(|p| p[d]), 1.0));
        let count = |c: &Cubic| {
            let pairs = middles.iter().zip(&shares);
            pairs
                .filter(|(m, t)| is_wrong(**m, &tangent_line(c, **t)))
                .count()
        };
        let end = separating_cubic(&middles, &shares, start);
        assert!(
            count(&start) > 20 && count(&end) <= 3,
            "{} {}",
            count(&start),
            count(&end)
        );
    }
}
