//! Outlines that are arcs of conics: what a camera sees of circles and of holes.

use nalgebra::{SMatrix, SVector};
use nurbs::{Basis, MAX_DEGREE};

use super::likelihood::{Linear, Sightings, WIDTHS};

/// Numbers of a conic.
pub(crate) const NUMBERS: usize = 5;
/// Times that it is looked for near the one before.
const ROUNDS: usize = 4;

/// The first width by which it is looked for.
const NEARBY: usize = 2;

/// The places where a quadratic form vanishes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Conic {
    /// Of `x^2 - y^2`, `x y`, `x`, `y`, 1; the form has `x^2 + y^2` besides, so that it is no
    /// rectangular hyperbola, and never vanishes everywhere.
    numbers: SVector<f64, NUMBERS>,
    /// Place and unit of its coordinates, pitches.
    middle: [f64; 2],
    unit: f64,
    /// The form is above zero inside the outline, or below.
    sign: f64,
}

impl Conic {
    /// The conic nearest to places; `None` where they do not tell. `inside` lies inside.
    pub(crate) fn near(places: &[[f64; 2]], inside: [f64; 2]) -> Option<Self> {
        let count = places.len() as f64;
        let mean = |d: usize| places.iter().map(|p| p[d]).sum::<f64>() / count;
        let middle = [mean(0), mean(1)];
        let spread = |p: &[f64; 2]| {
            let (x, y) = (p[0] - middle[0], p[1] - middle[1]);
            x * x + y * y
        };
        let unit = libm::sqrt(places.iter().map(spread).sum::<f64>() / count);
        let mut conic = Self {
            numbers: SVector::zeros(),
            middle,
            unit,
            sign: 1.0,
        };
        for _ in 0..ROUNDS {
            let mut matrix = SMatrix::<f64, NUMBERS, NUMBERS>::zeros();
            let mut right = SVector::<f64, NUMBERS>::zeros();
            for place in places {
                let (terms, round) = conic.terms(*place);
                let slope = conic.slope(*place);
                let weight = if slope > 0.0 {
                    1.0 / (slope * slope)
                } else {
                    1.0
                };
                matrix += terms * terms.transpose() * weight;
                right -= terms * (weight * round);
            }
            conic.numbers = matrix.cholesky()?.solve(&right);
        }
        conic.sign = conic.form(inside).signum();
        conic.numbers.iter().all(|n| n.is_finite()).then_some(conic)
    }

    /// The conic with which sightings are the likeliest, looked for near this one, and minus the
    /// logarithm of the likelihood.
    pub(crate) fn likeliest(mut self, sightings: &Sightings) -> Option<(f64, Self)> {
        let mut cost = f64::INFINITY;
        for round in 0..ROUNDS {
            let seen = sightings.elsewhere(|s| self.inside(s.place));
            let bases: Vec<Basis> = sightings
                .iter()
                .map(|s| {
                    let by = -self.sign / self.slope(s.place);
                    let mut values = [0.0; MAX_DEGREE + 1];
                    values[..NUMBERS].copy_from_slice((self.terms(s.place).0 * by).as_slice());
                    Basis { first: 0, values }
                })
                .collect();
            let found = seen.likeliest(&Linear {
                bases: &bases,
                width: NUMBERS,
                count: NUMBERS,
                conditions: &[],
                before: 1.0,
                // It is near already.
                widths: &WIDTHS[if round == 0 { NEARBY } else { WIDTHS.len() - 1 }..],
            })?;
            let mut next = self.clone();
            next.numbers +=
                SVector::<f64, NUMBERS>::from_column_slice(found.coefficients.as_slice());
            let reached = sightings.elsewhere(|s| next.inside(s.place)).cost();
            if reached >= cost {
                break;
            }
            (cost, self) = (reached, next);
        }
        cost.is_finite().then_some((cost, self))
    }

    /// About how far a place near it lies inside, pitches.
    pub(crate) fn inside(&self, place: [f64; 2]) -> f64 {
        self.sign * self.form(place) / self.slope(place)
    }

    /// How far a ray from a place near it meets it, in lengths of `direction`.
    pub(crate) fn along(&self, place: [f64; 2], direction: [f64; 2]) -> Option<f64> {
        let at = |t: f64| self.form([0, 1].map(|d| place[d] + t * direction[d]));
        let mut t = 0.0;
        for _ in 0..20 {
            const H: f64 = 1e-4;
            let step = at(t) * 2.0 * H / (at(t + H) - at(t - H));
            if !step.is_finite() {
                return None;
            }
            t -= step;
            if step.abs() < 1e-9 {
                return Some(t);
            }
        }
        None
    }

    /// What the numbers are multiplied by, and what is added.
    fn terms(&self, place: [f64; 2]) -> (SVector<f64, NUMBERS>, f64) {
        let [x, y] = [0, 1].map(|d| (place[d] - self.middle[d]) / self.unit);
        let terms = SVector::from([x * x - y * y, x * y, x, y, 1.0]);
        (terms, x * x + y * y)
    }

    fn form(&self, place: [f64; 2]) -> f64 {
        let (terms, round) = self.terms(place);
        terms.dot(&self.numbers) + round
    }

    /// Length of the form's gradient, for each pitch.
    fn slope(&self, place: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|d| (place[d] - self.middle[d]) / self.unit);
        let n = &self.numbers;
        let by_x = 2.0 * (1.0 + n[0]) * x + n[1] * y + n[2];
        let by_y = 2.0 * (1.0 - n[0]) * y + n[1] * x + n[3];
        libm::hypot(by_x, by_y) / self.unit
    }
}
