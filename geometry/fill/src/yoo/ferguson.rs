//! Cubic curves with continuous second derivatives through points at equal steps, and bicubic patches.

use glam::DVec3;
use nurbs::{BSplineSurface, KnotVector};

/// Tangents, derivatives over the parameter that steps by `step`, of the cubic curve through points
/// that has continuous second derivatives; at its ends its third derivative goes on.
pub(super) fn tangents(points: &[DVec3], step: f64) -> Vec<DVec3> {
    let count = points.len();
    match count {
        0 | 1 => return vec![DVec3::ZERO; count],
        2 => return vec![(points[1] - points[0]) / step; 2],
        3 => {
            let middle = (points[2] - points[0]) / (2.0 * step);
            let first = (4.0 * points[1] - 3.0 * points[0] - points[2]) / (2.0 * step);
            let last = (3.0 * points[2] - 4.0 * points[1] + points[0]) / (2.0 * step);
            return vec![first, middle, last];
        }
        _ => {}
    }
    // Rows t[k-1] + 4 t[k] + t[k+1] = 3 (p[k+1] - p[k-1]) / step; the first and last by "not a knot":
    // t[0] + 2 t[1] = (-5 p[0] + 4 p[1] + p[2]) / (2 step).
    let (mut diagonal, mut right) = (vec![4.0; count], vec![DVec3::ZERO; count]);
    let (mut lower, mut upper) = (vec![1.0; count], vec![1.0; count]);
    for k in 1..count - 1 {
        right[k] = 3.0 * (points[k + 1] - points[k - 1]) / step;
    }
    let end = |a: DVec3, b: DVec3, c: DVec3| (-5.0 * a + 4.0 * b + c) / (2.0 * step);
    let last = count - 1;
    (diagonal[0], upper[0]) = (1.0, 2.0);
    right[0] = end(points[0], points[1], points[2]);
    (diagonal[last], lower[last]) = (1.0, 2.0);
    right[last] = -end(points[last], points[last - 1], points[last - 2]);
    for k in 1..count {
        let by = lower[k] / diagonal[k - 1];
        diagonal[k] -= by * upper[k - 1];
        let before = right[k - 1];
        right[k] -= by * before;
    }
    let mut out = vec![DVec3::ZERO; count];
    out[last] = right[last] / diagonal[last];
    for k in (0..last).rev() {
        out[k] = (right[k] - upper[k] * out[k + 1]) / diagonal[k];
    }
    out
}

/// Points in rows of a grid with equal steps.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// By columns: all rows of the first one first.
    pub(super) points: Vec<DVec3>,
}

impl Grid {
    fn along_u(&self, of: &[DVec3], step: f64) -> Vec<DVec3> {
        let mut out = vec![DVec3::ZERO; of.len()];
        for j in 0..self.rows {
            let row: Vec<DVec3> = (0..self.columns).map(|i| of[i * self.rows + j]).collect();
            for (i, tangent) in tangents(&row, step).into_iter().enumerate() {
                out[i * self.rows + j] = tangent;
            }
        }
        out
    }

    fn along_v(&self, of: &[DVec3], step: f64) -> Vec<DVec3> {
        of.chunks(self.rows)
            .flat_map(|column| tangents(column, step))
            .collect()
    }

    /// The Ferguson patches through the points as one B-spline surface: each node's point, tangents and
    /// twist make four control points, and inner knots are double. Twists are the tangents' own
    /// tangents, so that second derivatives are continuous as well.
    pub(super) fn patches(&self, origin: [f64; 2], steps: [f64; 2]) -> Option<BSplineSurface> {
        let u = self.along_u(&self.points, steps[0]);
        let v = self.along_v(&self.points, steps[1]);
        let twist = self.along_v(&u, steps[1]);
        let knots = |count: usize, first: f64, step: f64| {
            let mut knots = Vec::new();
            for k in 0..count {
                let times = if k == 0 || k + 1 == count { 4 } else { 2 };
                knots.extend(std::iter::repeat_n(first + step * k as f64, times));
            }
            KnotVector::new(3, knots).ok()
        };
        let u_knots = knots(self.columns, origin[0], steps[0])?;
        let v_knots = knots(self.rows, origin[1], steps[1])?;
        // Before and behind a node; at the ends the node itself in place of what lies outside.
        let sides = |k: usize, count: usize| {
            let before = if k == 0 { 0.0 } else { -1.0 };
            let behind = if k + 1 == count { 0.0 } else { 1.0 };
            [before, behind]
        };
        let mut control = Vec::with_capacity(4 * self.points.len());
        for i in 0..self.columns {
            for by_u in sides(i, self.columns) {
                for j in 0..self.rows {
                    for by_v in sides(j, self.rows) {
                        let at = i * self.rows + j;
                        let (du, dv) = (by_u * steps[0] / 3.0, by_v * steps[1] / 3.0);
                        let own = self.points[at] + du * u[at] + dv * v[at] + du * dv * twist[at];
                        control.push(own.to_array());
                    }
                }
            }
        }
        BSplineSurface::new(u_knots, v_knots, control).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_their_own_curves() {
        let cubic = |t: f64| DVec3::new(t, t * t - 2.0, 0.5 * t * t * t - t);
        let slope = |t: f64| DVec3::new(1.0, 2.0 * t, 1.5 * t * t - 1.0);
        for count in [4, 5, 9] {
            let step = 0.3;
            let points: Vec<DVec3> = (0..count).map(|k| cubic(step * f64::from(k))).collect();
            for (k, own) in tangents(&points, step).into_iter().enumerate() {
                assert!(own.distance(slope(step * k as f64)) < 1e-12, "{count} {k}");
            }
        }
        let parabola: Vec<DVec3> = (0..3).map(|k| DVec3::splat(f64::from(k * k))).collect();
        assert!(tangents(&parabola, 1.0)[2].distance(DVec3::splat(4.0)) < 1e-12);
    }

    #[test]
    fn bicubic_surfaces_come_out_as_they_are() {
        let at = |u: f64, v: f64| {
            DVec3::new(u, v, 0.1 * u * u * u * v - v * v * u + 0.2 * u * v * v * v)
        };
        let (columns, rows) = (6, 5);
        let points = (0..columns * rows)
            .map(|k| {
                at(
                    2.0 + 0.5 * (k / rows) as f64,
                    -1.0 + 0.7 * (k % rows) as f64,
                )
            })
            .collect();
        let grid = Grid {
            columns,
            rows,
            points,
        };
        let surface = grid.patches([2.0, -1.0], [0.5, 0.7]).unwrap();
        for (u, v) in [(2.0, -1.0), (2.3, 0.1), (3.31, 1.2), (4.5, 1.8)] {
            let own = DVec3::from_array(surface.evaluate(u, v));
            assert!(own.distance(at(u, v)) < 1e-10, "{u} {v}: {own}");
        }
        // Second derivatives do not jump at knots.
        let bend = |u: f64| DVec3::from_array(surface.partial(u, 0.0, 2, 0));
        assert!(bend(3.0 - 1e-9).distance(bend(3.0 + 1e-9)) < 1e-6);
    }
}
