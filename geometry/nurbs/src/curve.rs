//! B-spline curves.

use crate::knots::KnotVector;

/// A polynomial B-spline curve in `D` dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct BSplineCurve<const D: usize> {
    knots: KnotVector,
    points: Vec<[f64; D]>,
}

/// There are not as many control points as basis functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the knots need {needed} control points, but there are {given}")]
pub struct ControlCountError {
    /// Control points the knots need.
    pub needed: usize,
    /// Control points given.
    pub given: usize,
}

impl<const D: usize> BSplineCurve<D> {
    /// A curve from knots and control points.
    ///
    /// # Errors
    /// [`ControlCountError`] when their numbers do not match.
    pub fn new(knots: KnotVector, points: Vec<[f64; D]>) -> Result<Self, ControlCountError> {
        let (needed, given) = (knots.control_count(), points.len());
        if needed != given {
            return Err(ControlCountError { needed, given });
        }
        Ok(Self { knots, points })
    }

    pub(crate) fn assembled(knots: KnotVector, points: Vec<[f64; D]>) -> Self {
        debug_assert_eq!(knots.control_count(), points.len());
        Self { knots, points }
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points.
    #[must_use]
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The same curve run the other way, over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let (first, last) = self.knots.domain();
        let knots = self.knots.knots().iter().rev();
        // The ends must not pick up rounding from the reflection.
        let mirrored = knots.map(|&knot| match knot {
            knot if knot == first => last,
            knot if knot == last => first,
            knot => first + (last - knot),
        });
        let knots = KnotVector::assembled(self.knots.degree(), mirrored.collect());
        Self::assembled(knots, self.points.iter().rev().copied().collect())
    }

    /// The point at parameter `t`.
    #[must_use]
    pub fn evaluate(&self, t: f64) -> [f64; D] {
        self.derivative(t, 0)
    }

    /// The derivative of an order (0 is the point itself) at parameter `t`.
    #[must_use]
    pub fn derivative(&self, t: f64, order: usize) -> [f64; D] {
        let basis = self.knots.basis_derivative(t, order);
        let mut sum = [0.0; D];
        for k in 0..=self.knots.degree() {
            for (s, p) in sum.iter_mut().zip(&self.points[basis.first + k]) {
                *s += basis.values[k] * p;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_arc_and_its_derivatives() {
        // (t, t^2) on 0..2 as one Bezier arc.
        let knots = KnotVector::uniform(2, 1, 0.0, 2.0).unwrap();
        let curve = BSplineCurve::new(knots, vec![[0.0, 0.0], [1.0, 0.0], [2.0, 4.0]]).unwrap();
        for step in 0..=8 {
            let t = 0.25 * f64::from(step);
            let (p, d, dd) = (
                curve.evaluate(t),
                curve.derivative(t, 1),
                curve.derivative(t, 2),
            );
            assert!((p[0] - t).abs() < 1e-15 && (p[1] - t * t).abs() < 1e-14);
            assert!((d[0] - 1.0).abs() < 1e-14 && (d[1] - 2.0 * t).abs() < 1e-14);
            assert!(dd[0].abs() < 1e-14 && (dd[1] - 2.0).abs() < 1e-14);
        }
    }

    #[test]
    fn the_other_way_is_the_same_curve() {
        let knots = KnotVector::new(2, vec![0.25, 0.25, 0.25, 0.5, 1.25, 1.25, 1.25]).unwrap();
        let points = vec![[0.0, 1.0], [1.0, 3.0], [2.0, -1.0], [5.0, 0.0]];
        let curve = BSplineCurve::new(knots, points).unwrap();
        let back = curve.reversed();
        assert_eq!(back.knots().domain(), (0.25, 1.25));
        for k in 0..=20 {
            let t = 0.25 + 0.05 * f64::from(k);
            let (p, q) = (curve.evaluate(t), back.evaluate(1.5 - t));
            assert!((p[0] - q[0]).abs() < 1e-12 && (p[1] - q[1]).abs() < 1e-12);
        }
        assert_eq!(back.reversed(), curve);
    }

    #[test]
    fn numbers_must_match() {
        let knots = KnotVector::uniform(3, 2, 0.0, 1.0).unwrap();
        let error = BSplineCurve::new(knots, vec![[0.0]; 4]).unwrap_err();
        assert_eq!((error.needed, error.given), (5, 4));
    }
}
