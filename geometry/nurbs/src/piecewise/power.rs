//! B-splines to pieces of polynomials in powers of their parameters (IGES 112 and 114); the way back
//! is `to_bspline`.

use super::{PatchSurface, PiecewiseCubic};
use crate::curve::BSplineCurve;
use crate::knots::{Basis, KnotVector};
use crate::surface::BSplineSurface;

/// Highest degree of the pieces.
const CUBIC: usize = 3;

/// Coefficient of power `k`: the derivative of that order by this.
const FACTORIALS: [f64; CUBIC + 1] = [1.0, 1.0, 2.0, 6.0];

/// x and y of a surface over its own parameters may be off these by this part of their range.
const SAME: f64 = 1e-12;

/// The functions at a place, and their derivatives up to the third, divided by the factorials.
fn powers(knots: &KnotVector, t: f64) -> [Basis; CUBIC + 1] {
    core::array::from_fn(|order| {
        let mut basis = knots.basis_derivative(t, order);
        basis
            .values
            .iter_mut()
            .for_each(|value| *value /= FACTORIALS[order]);
        basis
    })
}

impl<const D: usize> PiecewiseCubic<D> {
    /// The same curve with the same parameter, a piece for each span. `None` where the degree is
    /// above 3.
    #[must_use]
    pub fn from_bspline(curve: &BSplineCurve<D>) -> Option<Self> {
        let knots = curve.knots();
        if knots.degree() > CUBIC {
            return None;
        }
        let breaks = knots.breaks();
        let piece = |start: &f64| {
            let powers = powers(knots, *start);
            core::array::from_fn(|d| {
                powers.each_ref().map(|basis| {
                    let points = &curve.points()[basis.first..];
                    let values = basis.values.iter().take(knots.degree() + 1);
                    values
                        .zip(points)
                        .map(|(value, point)| value * point[d])
                        .sum()
                })
            })
        };
        let pieces = breaks[..breaks.len() - 1].iter().map(piece).collect();
        Self::new(breaks, pieces).ok()
    }
}

impl PatchSurface {
    /// The same surface. `None` where a degree is above 3, or x and y are not the parameters.
    #[must_use]
    pub fn from_bspline(surface: &BSplineSurface) -> Option<Self> {
        let (u, v) = (surface.u_knots(), surface.v_knots());
        if u.degree() > CUBIC || v.degree() > CUBIC {
            return None;
        }
        let rows = v.control_count();
        let is_own = |knots: &KnotVector, i: usize, value: f64| {
            let (first, last) = knots.domain();
            let range = (last - first).max(first.abs()).max(last.abs());
            (value - knots.greville(i)).abs() <= SAME * range
        };
        let mut points = surface.points().iter().enumerate();
        if !points.all(|(k, p)| is_own(u, k / rows, p[0]) && is_own(v, k % rows, p[1])) {
            return None;
        }
        let (u_breaks, v_breaks) = (u.breaks(), v.breaks());
        let mut patches = Vec::with_capacity((u_breaks.len() - 1) * (v_breaks.len() - 1));
        let of_rows: Vec<_> = v_breaks.iter().map(|t| powers(v, *t)).collect();
        for start in &u_breaks[..u_breaks.len() - 1] {
            let along = powers(u, *start);
            for up in &of_rows[..of_rows.len() - 1] {
                patches.push(up.each_ref().map(|up| {
                    along.each_ref().map(|along| {
                        let mut sum = 0.0;
                        for (i, a) in along.values.iter().take(u.degree() + 1).enumerate() {
                            for (j, b) in up.values.iter().take(v.degree() + 1).enumerate() {
                                let point = (along.first + i) * rows + up.first + j;
                                sum += a * b * surface.points()[point][2];
                            }
                        }
                        sum
                    })
                }));
            }
        }
        Self::new(u_breaks, v_breaks, patches).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(degree: usize, inner: &[f64]) -> KnotVector {
        let ends = |value: f64| vec![value; degree + 1];
        KnotVector::new(degree, [ends(1.0), inner.to_vec(), ends(5.0)].concat()).unwrap()
    }

    #[test]
    fn a_parabola_has_its_coefficients() {
        // The control point of a function is its polar form: of t^2, the product of two knots.
        let knots = knots(2, &[2.0]);
        let of = |i: usize| {
            let (a, b) = (knots.knots()[i + 1], knots.knots()[i + 2]);
            [f64::midpoint(a, b), a * b]
        };
        let points = (0..knots.control_count()).map(of).collect();
        let curve = BSplineCurve::new(knots.clone(), points).unwrap();
        let pieces = PiecewiseCubic::from_bspline(&curve).unwrap();
        assert_eq!(pieces.breaks, [1.0, 2.0, 5.0]);
        for (start, piece) in [1.0, 2.0].into_iter().zip(&pieces.pieces) {
            let expected = [
                [start, 1.0, 0.0, 0.0],
                [start * start, 2.0 * start, 1.0, 0.0],
            ];
            for (own, expected) in piece.iter().flatten().zip(expected.iter().flatten()) {
                assert!((own - expected).abs() < 1e-12, "{piece:?}");
            }
        }
    }

    #[test]
    fn curves_of_any_smoothness_come_back() {
        let point = |k: usize| [k as f64, (k * k * 3 % 7) as f64, 1.0];
        for inner in [vec![], vec![2.0, 3.0, 3.0], vec![1.5, 4.0, 4.0, 4.0]] {
            let knots = knots(3, &inner);
            let points = (0..knots.control_count()).map(point).collect();
            let curve = BSplineCurve::new(knots, points).unwrap();
            let pieces = PiecewiseCubic::from_bspline(&curve).unwrap();
            let back = pieces.to_bspline(1e-9);
            assert_eq!(back.knots(), curve.knots());
            for (a, b) in back
                .points()
                .iter()
                .flatten()
                .zip(curve.points().iter().flatten())
            {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }
        let high = knots(4, &[]);
        let points = (0..5).map(point).collect();
        let curve = BSplineCurve::new(high, points).unwrap();
        assert_eq!(PiecewiseCubic::from_bspline(&curve), None);
    }

    fn surface(bend: f64) -> BSplineSurface {
        let (u, v) = (knots(3, &[2.0, 2.5, 4.0]), knots(3, &[3.0, 3.0]));
        let rows = v.control_count();
        let point = |k: usize| {
            let (i, j) = (k / rows, k % rows);
            [
                u.greville(i) + bend * (j as f64),
                v.greville(j),
                (k * k * 5 % 11) as f64,
            ]
        };
        let points = (0..u.control_count() * rows).map(point).collect();
        BSplineSurface::new(u.clone(), v.clone(), points).unwrap()
    }

    #[test]
    fn surfaces_over_x_and_y_come_back_and_others_are_not_taken() {
        let own = surface(0.0);
        let patches = PatchSurface::from_bspline(&own).unwrap();
        assert_eq!(patches.patches.len(), 4 * 2);
        for k in 0..=400 {
            let (u, v) = (1.0 + 0.2 * f64::from(k % 21), 1.0 + 0.2 * f64::from(k / 21));
            let [x, y, z] = own.evaluate(u, v);
            assert!((x - u).abs() < 1e-12 && (y - v).abs() < 1e-12);
            assert!((patches.evaluate(u, v)[2] - z).abs() < 1e-9, "{u} {v}");
        }
        let back = patches.to_bspline(1e-9);
        assert_eq!(
            (back.u_knots(), back.v_knots()),
            (own.u_knots(), own.v_knots())
        );
        assert_eq!(PatchSurface::from_bspline(&surface(0.1)), None);
    }
}
