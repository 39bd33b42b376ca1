//! B-spline surfaces.

use crate::curve::ControlCountError;
use crate::knots::KnotVector;

/// A polynomial tensor-product B-spline surface, in space or in another number of dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct BSplineSurface<const D: usize = 3> {
    u_knots: KnotVector,
    v_knots: KnotVector,
    points: Vec<[f64; D]>,
}

impl<const D: usize> BSplineSurface<D> {
    /// A surface from knots and its control net, v fastest.
    ///
    /// # Errors
    /// [`ControlCountError`] when their numbers do not match.
    pub fn new(
        u_knots: KnotVector,
        v_knots: KnotVector,
        points: Vec<[f64; D]>,
    ) -> Result<Self, ControlCountError> {
        let (needed, given) = (
            u_knots.control_count() * v_knots.control_count(),
            points.len(),
        );
        if needed != given {
            return Err(ControlCountError { needed, given });
        }
        Ok(Self {
            u_knots,
            v_knots,
            points,
        })
    }

    pub(crate) fn assembled(
        u_knots: KnotVector,
        v_knots: KnotVector,
        points: Vec<[f64; D]>,
    ) -> Self {
        debug_assert_eq!(
            u_knots.control_count() * v_knots.control_count(),
            points.len()
        );
        Self {
            u_knots,
            v_knots,
            points,
        }
    }

    /// The knots in u.
    #[must_use]
    pub fn u_knots(&self) -> &KnotVector {
        &self.u_knots
    }

    /// The knots in v.
    #[must_use]
    pub fn v_knots(&self) -> &KnotVector {
        &self.v_knots
    }

    /// The control net, v fastest.
    #[must_use]
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// Control point `(i, j)`.
    #[must_use]
    pub fn point(&self, i: usize, j: usize) -> Option<[f64; D]> {
        let rows = self.v_knots.control_count();
        (j < rows)
            .then(|| self.points.get(i * rows + j).copied())
            .flatten()
    }

    /// The point at `(u, v)`.
    #[must_use]
    pub fn evaluate(&self, u: f64, v: f64) -> [f64; D] {
        self.partial(u, v, 0, 0)
    }

    /// The partial derivative of order `u_order` in u and `v_order` in v.
    #[must_use]
    pub fn partial(&self, u: f64, v: f64, u_order: usize, v_order: usize) -> [f64; D] {
        let a = self.u_knots.basis_derivative(u, u_order);
        let b = self.v_knots.basis_derivative(v, v_order);
        let rows = self.v_knots.control_count();
        let mut sum = [0.0; D];
        for i in 0..=self.u_knots.degree() {
            for j in 0..=self.v_knots.degree() {
                let weight = a.values[i] * b.values[j];
                let point = &self.points[(a.first + i) * rows + b.first + j];
                for (s, p) in sum.iter_mut().zip(point) {
                    *s += weight * p;
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_net_gives_the_hyperbolic_paraboloid() {
        let u = KnotVector::uniform(2, 3, 0.0, 3.0).unwrap();
        let v = KnotVector::uniform(1, 2, -1.0, 1.0).unwrap();
        let mut points = Vec::new();
        for i in 0..u.control_count() {
            for j in 0..v.control_count() {
                let (x, y) = (u.greville(i), v.greville(j));
                points.push([x, y, x * y]);
            }
        }
        let surface = BSplineSurface::new(u, v, points).unwrap();
        for (u, v) in [(0.0, -1.0), (0.7, 0.3), (2.0, 0.0), (3.0, 1.0)] {
            let p = surface.evaluate(u, v);
            assert!(
                (p[0] - u).abs() < 1e-14 && (p[2] - u * v).abs() < 1e-14,
                "{p:?}"
            );
            assert!((surface.partial(u, v, 1, 0)[2] - v).abs() < 1e-13);
            assert!((surface.partial(u, v, 1, 1)[2] - 1.0).abs() < 1e-13);
        }
        assert!(surface.point(0, 9).is_none());
    }
}
