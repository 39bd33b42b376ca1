//! Exact conversion of piecewise polynomials to B-splines, by blossoming: a control
//! point is the polar form of any piece under its basis function, taken at the inner
//! knots of that function.

use super::{PatchSurface, PiecewiseCubic, cubic};
use crate::curve::BSplineCurve;
use crate::knots::KnotVector;
use crate::surface::BSplineSurface;

/// Degree of every piece.
const DEGREE: usize = 3;

impl<const D: usize> PiecewiseCubic<D> {
    /// The same curve as a cubic B-spline with the same parameter.
    ///
    /// A break gets multiplicity 3 where pieces only meet, 2 where the first and 1 where
    /// the second derivative agrees too, each to `tolerance` (in the unit of the points;
    /// derivatives are scaled by the width of the narrower piece). With 0 only breaks
    /// that agree to the last bit are thinned. Pieces are taken to meet.
    #[must_use]
    pub fn to_bspline(&self, tolerance: f64) -> BSplineCurve<D> {
        let joint = |k: usize| {
            self.pieces[k - 1]
                .iter()
                .zip(&self.pieces[k])
                .map(|(left, right)| multiplicity(&self.breaks, k, left, right, tolerance))
                .max()
                .unwrap_or(DEGREE)
        };
        let multiplicities: Vec<usize> = (1..self.pieces.len()).map(joint).collect();
        let plan = plan(&self.breaks, &multiplicities);
        let points = plan
            .iter()
            .map(|control| self.pieces[control.piece].map(|c| dot(&c, &control.polar)))
            .collect();
        BSplineCurve::assembled(knots(&self.breaks, &multiplicities), points)
    }
}

impl PatchSurface {
    /// The same surface as a bicubic B-spline; x is linear in u and y in v.
    ///
    /// Multiplicities of interior knots as in [`PiecewiseCubic::to_bspline`], the worst
    /// along the whole break counting. Patches are taken to meet.
    #[must_use]
    pub fn to_bspline(&self, tolerance: f64) -> BSplineSurface {
        let (columns, rows) = (self.u_breaks.len() - 1, self.v_breaks.len() - 1);
        let patch = |i: usize, j: usize| &self.patches[i * rows + j];
        // A polynomial in t that is small at four places of the patch is small in it all
        // (within a factor of about 3), so jumps are compared there.
        let places = |width: f64| [0.0, width / 3.0, width * 2.0 / 3.0, width];
        let u_joint = |i: usize| {
            let mut worst = 1;
            for j in 0..rows {
                for t in places(self.v_breaks[j + 1] - self.v_breaks[j]) {
                    let slice =
                        |p: &[[f64; 4]; 4]| transposed(p).map(|column| cubic(&column, t, 0));
                    let (left, right) = (slice(patch(i - 1, j)), slice(patch(i, j)));
                    worst = worst.max(multiplicity(&self.u_breaks, i, &left, &right, tolerance));
                }
            }
            worst
        };
        let v_joint = |j: usize| {
            let mut worst = 1;
            for i in 0..columns {
                for s in places(self.u_breaks[i + 1] - self.u_breaks[i]) {
                    let slice = |p: &[[f64; 4]; 4]| p.map(|row| cubic(&row, s, 0));
                    let (left, right) = (slice(patch(i, j - 1)), slice(patch(i, j)));
                    worst = worst.max(multiplicity(&self.v_breaks, j, &left, &right, tolerance));
                }
            }
            worst
        };
        let u_multiplicities: Vec<usize> = (1..columns).map(u_joint).collect();
        let v_multiplicities: Vec<usize> = (1..rows).map(v_joint).collect();
        let (u_plan, v_plan) = (
            plan(&self.u_breaks, &u_multiplicities),
            plan(&self.v_breaks, &v_multiplicities),
        );
        let mut points = Vec::with_capacity(u_plan.len() * v_plan.len());
        for a in &u_plan {
            for b in &v_plan {
                let along_u = patch(a.piece, b.piece).map(|row| dot(&row, &a.polar));
                points.push([a.greville, b.greville, dot(&along_u, &b.polar)]);
            }
        }
        BSplineSurface::assembled(
            knots(&self.u_breaks, &u_multiplicities),
            knots(&self.v_breaks, &v_multiplicities),
            points,
        )
    }
}

fn transposed(patch: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let mut out = [[0.0; 4]; 4];
    for (b, row) in patch.iter().enumerate() {
        for (a, value) in row.iter().enumerate() {
            out[a][b] = *value;
        }
    }
    out
}

/// Knot multiplicity that the joint of two cubics at break `k` needs.
fn multiplicity(
    breaks: &[f64],
    k: usize,
    left: &[f64; 4],
    right: &[f64; 4],
    tolerance: f64,
) -> usize {
    let width = breaks[k] - breaks[k - 1];
    let narrow = width.min(breaks[k + 1] - breaks[k]);
    let first = (cubic(left, width, 1) - right[1]).abs() * narrow;
    let second = (cubic(left, width, 2) - 2.0 * right[2]).abs() * narrow * narrow;
    if first > tolerance {
        3
    } else if second > tolerance {
        2
    } else {
        1
    }
}

fn knots(breaks: &[f64], multiplicities: &[usize]) -> KnotVector {
    KnotVector::assembled(DEGREE, repeated(breaks, multiplicities))
}

fn repeated(breaks: &[f64], multiplicities: &[usize]) -> Vec<f64> {
    let last = breaks.len() - 1;
    let mut knots = Vec::with_capacity(2 * (DEGREE + 1) + multiplicities.iter().sum::<usize>());
    for (k, &b) in breaks.iter().enumerate() {
        let times = if k == 0 || k == last {
            DEGREE + 1
        } else {
            multiplicities[k - 1]
        };
        knots.extend(core::iter::repeat_n(b, times));
    }
    knots
}

/// How one control value follows from the coefficients of a piece.
struct Control {
    piece: usize,
    /// Factors of the four coefficients: the polar form of the powers at the inner knots.
    polar: [f64; 4],
    /// Mean of the inner knots: the control value of the parameter itself.
    greville: f64,
}

fn plan(breaks: &[f64], multiplicities: &[usize]) -> Vec<Control> {
    let knots = repeated(breaks, multiplicities);
    (0..knots.len() - DEGREE - 1)
        .map(|i| {
            // Spans under basis function i, the middle ones first: their polar form is
            // taken nearest to where it holds to the last digit.
            let span = [i + 1, i + 2, i, i + 3]
                .into_iter()
                .find(|&j| knots[j] < knots[j + 1])
                .unwrap_or(i);
            let piece = super::piece_at(breaks, knots[span]);
            let [a, b, c] = [1, 2, 3].map(|d| knots[i + d] - breaks[piece]);
            Control {
                piece,
                polar: [
                    1.0,
                    (a + b + c) / 3.0,
                    (a * b + b * c + c * a) / 3.0,
                    a * b * c,
                ],
                greville: if knots[i + 1] == knots[i + 3] {
                    knots[i + 1]
                } else {
                    (knots[i + 1] + knots[i + 2] + knots[i + 3]) / 3.0
                },
            }
        })
        .collect()
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_keeps_its_points_whatever_the_joint() {
        // Joints: C0, C1, C2 and C3 (one cubic cut in two).
        let second_pieces = [
            ([1.0, -1.0, 0.3, 0.2], 3),
            ([1.0, 2.0, 0.3, 0.2], 2),
            ([1.0, 2.0, 1.0, 0.2], 1),
            ([1.0, 2.0, 1.0, 0.0], 1),
        ];
        for (second, expected) in second_pieces {
            let curve =
                PiecewiseCubic::new(vec![0.0, 1.0, 3.0], vec![[[0.0, 0.0, 1.0, 0.0]], [second]])
                    .unwrap();
            let spline = curve.to_bspline(1e-12);
            assert_eq!(spline.knots().knots().len(), 8 + expected);
            for step in 0..=60 {
                let t = 0.05 * f64::from(step);
                assert!((spline.evaluate(t)[0] - curve.evaluate(t)[0]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn surface_keeps_its_points() {
        let rough = |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64;
        let surface = PatchSurface::through_thirds(
            vec![10.0, 11.5, 13.0, 14.5],
            vec![-2.0, -1.0, 0.0],
            rough,
        )
        .unwrap();
        let spline = surface.to_bspline(0.0);
        assert_eq!(spline.u_knots().control_count(), 10);
        assert_eq!(spline.v_knots().control_count(), 7);
        for i in 0..=30 {
            for j in 0..=20 {
                let (u, v) = (10.0 + 0.15 * f64::from(i), -2.0 + 0.1 * f64::from(j));
                let (a, b) = (spline.evaluate(u, v), surface.evaluate(u, v));
                for d in 0..3 {
                    assert!((a[d] - b[d]).abs() < 1e-11, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn a_smooth_surface_needs_few_knots() {
        let surface =
            PatchSurface::through_thirds(vec![0.0, 3.0, 6.0], vec![0.0, 3.0, 6.0], |i, j| {
                (i * i) as f64 - (i * j) as f64
            })
            .unwrap();
        let spline = surface.to_bspline(1e-10);
        assert_eq!(spline.u_knots().control_count(), 5);
        let p = spline.evaluate(2.2, 4.7);
        assert!((p[0] - 2.2).abs() < 1e-13 && (p[1] - 4.7).abs() < 1e-13);
        assert!((p[2] - (2.2 * 2.2 - 2.2 * 4.7)).abs() < 1e-11);
    }
}
