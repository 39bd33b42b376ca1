//! How likely an outline is, given the samples beside it.
//!
//! Samples lie closer to an outline than nodes do, on both sides of it once the missing ones
//! are counted: those that are there lie inside, and the missing ones outside. None of them is
//! believed beyond doubt: samples are lost inside, too, and the edge of a spot may catch a
//! surface that its middle misses.

use nalgebra::{DMatrix, DVector};
use nurbs::Basis;

use super::layout::Condition;
use crate::evidence::Seen;

/// A sample as seen from a path; lengths in pitches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sighting {
    /// Where along the path it is nearest, from its start.
    pub(crate) along: f64,
    /// How far it lies inside the path.
    pub(crate) inside: f64,
    pub(crate) place: [f64; 2],
    pub(crate) seen: Seen,
}

/// Samples present and missing of which an outline has at least so many each.
const LEAST: usize = 6;
/// Over how much of the pitch an edge is found blurred: wide first, so that far ones draw.
const WIDTHS: [f64; 4] = [0.108, 0.063, 0.036, 0.0216];
/// Chance that a sample is there although the middle of its spot misses the surface.
const GRAZED: f64 = 0.003;
/// Share of samples lost where too few are known to tell, and how many that counts for.
const DROPPED: f64 = 0.03;
const DROPPED_OF: f64 = 30.0;
/// Steps of Newton's method for each width.
const STEPS: usize = 12;
/// Price of each number of a path, in logarithms of the sightings.
const PRICE: f64 = 0.5;
/// How much each condition weighs.
const BINDING: f64 = 1e9;

/// Sightings, and what can be known from their numbers alone.
#[derive(Debug, Clone)]
pub(crate) struct Sightings {
    /// But for the lost ones.
    all: Vec<Sighting>,
    /// Share of samples lost inside.
    dropped: f64,
}

/// An outline that is moved inwards by sums of functions.
pub(crate) struct Linear<'a> {
    /// The functions that do not vanish at each sighting, the first `width` of each.
    pub(crate) bases: &'a [Basis],
    pub(crate) width: usize,
    /// All functions.
    pub(crate) count: usize,
    pub(crate) conditions: &'a [Condition],
    /// Standard deviation of each coefficient before anything is known of it.
    pub(crate) before: f64,
}

/// The likeliest coefficients.
pub(crate) struct Likeliest {
    /// Minus the logarithm of the likelihood.
    pub(crate) cost: f64,
    pub(crate) coefficients: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

impl Sightings {
    /// `None` where they are too few to tell of an outline.
    pub(crate) fn enough(all: Vec<Sighting>) -> Option<Self> {
        let count = |seen: Seen| all.iter().filter(|s| s.seen == seen).count();
        let is_enough = count(Seen::Present) >= LEAST && count(Seen::Missing) >= LEAST;
        is_enough.then(|| Self::new(all))
    }

    pub(crate) fn new(mut all: Vec<Sighting>) -> Self {
        let count = |seen: Seen| all.iter().filter(|s| s.seen == seen).count();
        let (present, lost) = (count(Seen::Present), count(Seen::Lost) as f64);
        let dropped = (lost + DROPPED * DROPPED_OF) / (lost + present as f64 + DROPPED_OF);
        all.retain(|s| s.seen != Seen::Lost);
        Self { all, dropped }
    }

    pub(crate) fn those(&self, keep: impl FnMut(&Sighting) -> bool) -> Self {
        let mut part = self.clone();
        part.all.retain(keep);
        part
    }

    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = &Sighting> {
        self.all.iter()
    }

    /// The same samples as seen from another outline.
    pub(crate) fn elsewhere(&self, mut inside: impl FnMut(&Sighting) -> f64) -> Self {
        let mut seen = self.clone();
        for sighting in &mut seen.all {
            sighting.inside = inside(sighting);
        }
        seen
    }

    /// What so many numbers have to gain at least, to be worth it.
    pub(crate) fn price(&self, numbers: usize) -> f64 {
        PRICE * libm::log(self.all.len() as f64) * numbers as f64
    }

    /// What an outline costs that is where the sightings are seen from.
    pub(crate) fn cost(&self) -> f64 {
        let width = WIDTHS[WIDTHS.len() - 1];
        let each = self.all.iter();
        each.map(|s| -libm::log(self.chance(s.seen, s.inside, width).0))
            .sum()
    }

    /// The coefficients with which the sightings are the likeliest.
    pub(crate) fn likeliest(&self, linear: &Linear<'_>) -> Option<Likeliest> {
        let mut found = DVector::zeros(linear.count);
        let mut least = f64::INFINITY;
        for width in WIDTHS {
            least = self.cost_at(linear, &found, width);
            let mut damping = 1e-3;
            for _ in 0..STEPS {
                let (matrix, right) = self.normal_equations(linear, &found, width);
                let mut stepped = false;
                while damping < 1e6 {
                    let mut damped = matrix.clone();
                    for k in 0..linear.count {
                        damped[(k, k)] *= 1.0 + damping;
                    }
                    bind(&mut damped, linear.conditions);
                    let next = &found + damped.cholesky()?.solve(&right);
                    let cost = self.cost_at(linear, &next, width);
                    if cost < least {
                        stepped = least - cost > 1e-6 * least;
                        (found, least) = (next, cost);
                        damping *= 0.1;
                        break;
                    }
                    damping *= 10.0;
                }
                if !stepped {
                    break;
                }
            }
        }
        let last = WIDTHS[WIDTHS.len() - 1];
        let mut matrix = self.normal_equations(linear, &found, last).0;
        bind(&mut matrix, linear.conditions);
        Some(Likeliest {
            cost: least,
            covariance: matrix.cholesky()?.inverse(),
            coefficients: found,
        })
    }

    /// Chance of a sighting and its derivative by how far it lies inside.
    fn chance(&self, seen: Seen, inside: f64, width: f64) -> (f64, f64) {
        let within = 1.0 / (1.0 + libm::exp(-inside / width));
        let slope = within * (1.0 - within) / width;
        match seen {
            // A lost sample is one that could be there.
            Seen::Present | Seen::Lost => {
                (GRAZED + (1.0 - GRAZED) * within, (1.0 - GRAZED) * slope)
            }
            Seen::Missing => {
                let share = 1.0 - self.dropped;
                (1.0 - share * within, -share * slope)
            }
        }
    }

    fn cost_at(&self, linear: &Linear<'_>, at: &DVector<f64>, width: f64) -> f64 {
        let each = self.all.iter().zip(linear.bases);
        let costs = each.map(|(s, basis)| {
            let inside = s.inside - linear.sum(basis, at);
            -libm::log(self.chance(s.seen, inside, width).0)
        });
        costs.sum::<f64>() + at.norm_squared() / (2.0 * linear.before * linear.before)
    }

    fn normal_equations(
        &self,
        linear: &Linear<'_>,
        at: &DVector<f64>,
        width: f64,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let known = 1.0 / (linear.before * linear.before);
        let mut matrix = DMatrix::identity(linear.count, linear.count) * known;
        let mut right = -at * known;
        for (s, basis) in self.all.iter().zip(linear.bases) {
            let inside = s.inside - linear.sum(basis, at);
            let (chance, slope) = self.chance(s.seen, inside, width);
            // Moving the outline inwards lessens how far a sample lies inside.
            let pull = -slope / chance;
            let weight = slope * slope / (chance * (1.0 - chance)).max(1e-9);
            let values = &basis.values[..linear.width];
            for (row, a) in values.iter().enumerate() {
                right[basis.first + row] += pull * a;
                for (column, b) in values.iter().enumerate() {
                    matrix[(basis.first + row, basis.first + column)] += weight * a * b;
                }
            }
        }
        (matrix, right)
    }
}

impl Linear<'_> {
    fn sum(&self, basis: &Basis, coefficients: &DVector<f64>) -> f64 {
        let own = coefficients.as_slice()[basis.first..].iter();
        basis.values[..self.width]
            .iter()
            .zip(own)
            .map(|(b, c)| b * c)
            .sum()
    }
}

/// Adds what conditions weigh.
pub(crate) fn bind(matrix: &mut DMatrix<f64>, conditions: &[Condition]) {
    for condition in conditions {
        for &(row, value) in condition {
            for &(column, other) in condition {
                matrix[(row, column)] += BINDING * value * other;
            }
        }
    }
}
