//! Rational B-splines: points with weights (Piegl & Tiller 1997, chapter 4), kept as polynomial ones
//! in homogeneous coordinates, so that whatever is done to those is done to these.

use crate::curve::BSplineCurve;
use crate::knots::KnotVector;
use crate::surface::BSplineSurface;

/// Why points and weights make no rational spline.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RationalError {
    /// Not as many points as functions.
    #[error(transparent)]
    Count(#[from] crate::ControlCountError),
    /// Not as many weights as points.
    #[error("there are {points} control points, but {weights} weights")]
    Weights {
        /// Control points given.
        points: usize,
        /// Weights given.
        weights: usize,
    },
    /// A weight is not above 0.
    #[error("weight {index} ({value}) is not above 0")]
    Weight {
        /// Its index.
        index: usize,
        /// Its value.
        value: f64,
    },
}

/// A rational curve in space.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalCurve {
    /// Points times their weights, and the weights.
    pub homogeneous: BSplineCurve<4>,
}

/// A rational surface in space.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalSurface {
    /// Points times their weights, and the weights.
    pub homogeneous: BSplineSurface<4>,
}

fn weighted(points: &[[f64; 3]], weights: &[f64]) -> Result<Vec<[f64; 4]>, RationalError> {
    let counts = (points.len(), weights.len());
    if counts.0 != counts.1 {
        return Err(RationalError::Weights {
            points: counts.0,
            weights: counts.1,
        });
    }
    let is_bad = |w: &f64| !(w.is_finite() && *w > 0.0);
    if let Some(index) = weights.iter().position(is_bad) {
        let value = weights[index];
        return Err(RationalError::Weight { index, value });
    }
    let both = points.iter().zip(weights);
    Ok(both
        .map(|([x, y, z], w)| [w * x, w * y, w * z, *w])
        .collect())
}

/// The first three coordinates divided by the last.
fn projected([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    [x / w, y / w, z / w]
}

impl RationalCurve {
    /// A curve from knots, control points and their weights.
    ///
    /// # Errors
    /// [`RationalError`] where numbers do not match, or a weight is not above 0.
    pub fn new(
        knots: KnotVector,
        points: &[[f64; 3]],
        weights: &[f64],
    ) -> Result<Self, RationalError> {
        let homogeneous = BSplineCurve::new(knots, weighted(points, weights)?)?;
        Ok(Self { homogeneous })
    }

    /// The point at a parameter.
    #[must_use]
    pub fn evaluate(&self, t: f64) -> [f64; 3] {
        projected(self.homogeneous.evaluate(t))
    }

    /// The first two derivatives at a parameter (their equation 4.8).
    #[must_use]
    pub fn derivatives(&self, t: f64) -> [[f64; 3]; 2] {
        let at = |order: usize| self.homogeneous.derivative(t, order);
        let (h0, h1, h2) = (at(0), at(1), at(2));
        let w = h0[3];
        let point = projected(h0);
        let first: [f64; 3] = core::array::from_fn(|d| (h1[d] - h1[3] * point[d]) / w);
        let second =
            core::array::from_fn(|d| (h2[d] - 2.0 * h1[3] * first[d] - h2[3] * point[d]) / w);
        [first, second]
    }
}

impl RationalSurface {
    /// A surface from knots, its control net, v fastest, and their weights.
    ///
    /// # Errors
    /// [`RationalError`] where numbers do not match, or a weight is not above 0.
    pub fn new(
        (u_knots, v_knots): (KnotVector, KnotVector),
        points: &[[f64; 3]],
        weights: &[f64],
    ) -> Result<Self, RationalError> {
        let homogeneous = BSplineSurface::new(u_knots, v_knots, weighted(points, weights)?)?;
        Ok(Self { homogeneous })
    }

    /// The point at `(u, v)`.
    #[must_use]
    pub fn evaluate(&self, u: f64, v: f64) -> [f64; 3] {
        projected(self.homogeneous.evaluate(u, v))
    }

    /// The first derivatives at `(u, v)`, along u and along v.
    #[must_use]
    pub fn partials(&self, u: f64, v: f64) -> [[f64; 3]; 2] {
        let h0 = self.homogeneous.evaluate(u, v);
        let point = projected(h0);
        [(1, 0), (0, 1)].map(|(a, b)| {
            let h1 = self.homogeneous.partial(u, v, a, b);
            core::array::from_fn(|d| (h1[d] - h1[3] * point[d]) / h0[3])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::Parameter;

    const HALF_ROOT: f64 = core::f64::consts::FRAC_1_SQRT_2;

    /// A full circle of radius 2 in nine points (Piegl & Tiller 1997, figure 7.16).
    fn circle() -> RationalCurve {
        let ring = [
            [1, 0],
            [1, 1],
            [0, 1],
            [-1, 1],
            [-1, 0],
            [-1, -1],
            [0, -1],
            [1, -1],
            [1, 0],
        ];
        let points = ring.map(|[x, y]| [2.0 * f64::from(x), 2.0 * f64::from(y), 1.0]);
        let weights: Vec<f64> = (0..9)
            .map(|k| if k % 2 == 0 { 1.0 } else { HALF_ROOT })
            .collect();
        let knots = vec![0., 0., 0., 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1., 1., 1.];
        RationalCurve::new(KnotVector::new(2, knots).unwrap(), &points, &weights).unwrap()
    }

    #[test]
    fn a_circle_is_a_circle_and_stays_one_with_more_knots_and_a_higher_degree() {
        let circle = circle();
        let finer = circle
            .homogeneous
            .with_knots(&[0.1, 0.6])
            .unwrap()
            .elevated()
            .unwrap();
        for curve in [circle, RationalCurve { homogeneous: finer }] {
            for k in 0..=100 {
                let t = 0.01 * f64::from(k);
                let [x, y, z] = curve.evaluate(t);
                assert!((libm::hypot(x, y) - 2.0).abs() < 1e-13 && (z - 1.0).abs() < 1e-13);
                let [first, second] = curve.derivatives(t);
                // Along the circle, with the curvature of one half.
                assert!((first[0] * x + first[1] * y).abs() < 1e-10);
                let cross = first[0] * second[1] - first[1] * second[0];
                let speed = libm::hypot(first[0], first[1]);
                assert!((cross / (speed * speed * speed) - 0.5).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_cylinder_is_a_cylinder() {
        let circle = circle().homogeneous;
        let around = circle
            .points()
            .iter()
            .map(|[x, y, _, w]| ([x / w, y / w], *w));
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for ([x, y], w) in around {
            for z in [0.0, 5.0] {
                points.push([x, y, z]);
                weights.push(w);
            }
        }
        let along = KnotVector::uniform(1, 1, 0.0, 1.0).unwrap();
        let both = (circle.knots().clone(), along);
        let cylinder = RationalSurface::new(both, &points, &weights).unwrap();
        let (part, _) = cylinder.homogeneous.split(Parameter::U, 0.4).unwrap();
        for surface in [cylinder, RationalSurface { homogeneous: part }] {
            for (u, v) in [(0.0, 0.0), (0.13, 0.2), (0.39, 1.0)] {
                let [x, y, z] = surface.evaluate(u, v);
                assert!((libm::hypot(x, y) - 2.0).abs() < 1e-13 && (z - 5.0 * v).abs() < 1e-13);
                let [around, up] = surface.partials(u, v);
                assert!((around[0] * x + around[1] * y).abs() < 1e-10 && around[2].abs() < 1e-12);
                assert!((up[2] - 5.0).abs() < 1e-12 && up[0].abs() < 1e-12);
            }
        }
    }

    #[test]
    fn bad_weights_are_named() {
        let knots = KnotVector::uniform(1, 1, 0.0, 1.0).unwrap();
        let points = [[0.0; 3], [1.0; 3]];
        let error =
            |weights: &[f64]| RationalCurve::new(knots.clone(), &points, weights).unwrap_err();
        assert!(matches!(
            error(&[1.0]),
            RationalError::Weights {
                points: 2,
                weights: 1
            }
        ));
        assert!(matches!(
            error(&[1.0, -2.0]),
            RationalError::Weight { index: 1, .. }
        ));
        assert!(matches!(
            error(&[f64::NAN, 1.0]),
            RationalError::Weight { index: 0, .. }
        ));
    }
}
