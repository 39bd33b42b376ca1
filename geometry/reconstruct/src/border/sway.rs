//! Outlines moved by a smooth amount along them.

use nalgebra::{DMatrix, DVector};
use nurbs::Basis;

use super::deflect::Deflection;
use super::layout::Splines;
use super::likelihood::{Linear, Sightings, bind};

/// A smooth amount along a path.
#[derive(Debug, Clone)]
pub(crate) struct Sway {
    splines: Splines,
    coefficients: Vec<f64>,
    /// The splines by which it was found, and how well their coefficients are known.
    known: (Splines, DMatrix<f64>),
}

/// Standard deviation of an amount before anything is known of it, pitches.
const BEFORE: f64 = 0.5;

impl Sway {
    /// The likeliest amount by which a path is moved inwards, and what it costs: minus the
    /// logarithm of its likelihood, and the price of its freedom.
    pub(crate) fn of(sightings: &Sightings, splines: Splines) -> Option<(f64, Self)> {
        let bases: Vec<Basis> = sightings.iter().map(|s| splines.at(s.along, 0)).collect();
        let found = sightings.likeliest(&Linear {
            bases: &bases,
            width: 4,
            count: splines.count(),
            conditions: &splines.conditions(),
            before: BEFORE,
        })?;
        let cost = found.cost + sightings.price(splines.freedom());
        let sway = Self {
            coefficients: found.coefficients.as_slice().to_vec(),
            known: (splines.clone(), found.covariance),
            splines,
        };
        Some((cost, sway))
    }

    /// Another amount, known as well as this one: the spline nearest to `amounts` at places
    /// along the path.
    pub(crate) fn replaced(&self, splines: Splines, amounts: &[(f64, f64)]) -> Option<Self> {
        let count = splines.count();
        // What lies between places is as little as can be.
        let mut matrix = DMatrix::identity(count, count) * 1e-6;
        let mut right = DVector::zeros(count);
        for &(along, amount) in amounts {
            let basis = splines.at(along, 0);
            for (row, a) in basis.values.iter().take(4).enumerate() {
                right[basis.first + row] += a * amount;
                for (column, b) in basis.values.iter().take(4).enumerate() {
                    matrix[(basis.first + row, basis.first + column)] += a * b;
                }
            }
        }
        bind(&mut matrix, &splines.conditions());
        Some(Self {
            coefficients: matrix.cholesky()?.solve(&right).as_slice().to_vec(),
            known: self.known.clone(),
            splines,
        })
    }

    pub(crate) fn splines(&self) -> &Splines {
        &self.splines
    }

    /// How far it goes at most, pitches.
    pub(crate) fn farthest(&self) -> f64 {
        let ends = self.splines.breaks.windows(2);
        let places = ends.flat_map(|e| (0..=4).map(|k| e[0] + (e[1] - e[0]) * f64::from(k) / 4.0));
        places.map(|at| self.at(at, 0).abs()).fold(0.0, f64::max)
    }

    /// The other way.
    pub(crate) fn reversed(mut self) -> Self {
        for c in &mut self.coefficients {
            *c = -*c;
        }
        self
    }
}

impl Deflection for Sway {
    fn at(&self, along: f64, order: usize) -> f64 {
        let (first, last) = self.splines.knots.domain();
        // Exactly the same at both ends of a closed path.
        let is_back = self.splines.closed && along >= last;
        let basis = self.splines.at(if is_back { first } else { along }, order);
        let own = &self.coefficients[basis.first..basis.first + 4];
        basis.values.iter().zip(own).map(|(b, c)| b * c).sum()
    }

    fn variance(&self, along: f64) -> f64 {
        let (splines, covariance) = &self.known;
        let basis = splines.at(along, 0);
        let mut variance = 0.0;
        for (row, a) in basis.values.iter().take(4).enumerate() {
            for (column, b) in basis.values.iter().take(4).enumerate() {
                variance += a * b * covariance[(basis.first + row, basis.first + column)];
            }
        }
        variance
    }

    fn knots(&self) -> Vec<f64> {
        let breaks = &self.splines.breaks;
        breaks[1..breaks.len() - 1].to_vec()
    }
}
