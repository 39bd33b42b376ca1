//! Outlines moved by a smooth amount along them.

use nalgebra::{DMatrix, DVector};
use nurbs::Basis;
use rayon::prelude::*;

use super::deflect::Deflection;
use super::layout::Splines;
use super::likelihood::{Likeliest, Linear, Sightings, WIDTHS, bind};

/// A smooth amount along a path.
#[derive(Debug, Clone)]
pub(crate) struct Sway {
    splines: Splines,
    coefficients: Vec<f64>,
    /// How well the amounts at the two ends are known, as variances.
    at_ends: [f64; 2],
}

/// How well the coefficients of splines are known: the inverse of their covariance.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    splines: Splines,
    information: DMatrix<f64>,
}

/// Standard deviation of an amount before anything is known of it, pitches.
const BEFORE: f64 = 0.5;

/// How far the ends of lines may lie from where the likeliest has them, and the steps in which they
/// are looked at, pitches; and how much less likely the mean of them may be.
const AROUND: f64 = 0.8;
const STEP: f64 = 0.05;
const WORSE: f64 = 2.0;
/// What costs more than the likeliest by this is as likely as nothing: the exponential of minus it
/// is 0.
const NOTHING: f64 = 760.0;

impl Sway {
    /// The likeliest amount by which a path is moved inwards, and what it costs: minus the
    /// logarithm of its likelihood, and the price of its freedom.
    pub(crate) fn of(sightings: &Sightings, splines: Splines) -> Option<(f64, Self, Known)> {
        let bases: Vec<Basis> = sightings.iter().map(|s| splines.at(s.along, 0)).collect();
        let linear = Linear {
            bases: &bases,
            width: 4,
            count: splines.count(),
            conditions: &splines.conditions(),
            before: BEFORE,
            widths: &WIDTHS,
        };
        let found = sightings.likeliest(&linear)?;
        let coefficients = if splines.is_line == [true] {
            mean_line(sightings, &linear, &found)
        } else {
            found.coefficients
        };
        let cost = found.cost + sightings.price(splines.freedom());
        let sway = Self {
            coefficients: coefficients.as_slice().to_vec(),
            at_ends: [BEFORE * BEFORE; 2],
            splines: splines.clone(),
        };
        let known = Known {
            splines,
            information: found.information,
        };
        Some((cost, sway, known))
    }

    /// The same, its ends known so well.
    pub(crate) fn with(mut self, known: &Known) -> Self {
        let (first, last) = known.splines.knots.domain();
        self.at_ends = [first, last].map(|at| known.variance(at));
        self
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
            at_ends: self.at_ends,
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

/// The mean of all lines near the likeliest one, each as much as it is likely. One that runs nearly
/// along the samples of many columns passes between two of each: there all lines are as likely,
/// and the mean is the least wrong.
fn mean_line(sightings: &Sightings, linear: &Linear<'_>, likeliest: &Likeliest) -> DVector<f64> {
    let reach = (AROUND / STEP) as i32;
    let moved = |by: [f64; 2]| {
        let each = (0..linear.count).map(|k| {
            let share = k as f64 / (linear.count - 1) as f64;
            by[0] + share * (by[1] - by[0])
        });
        &likeliest.coefficients + DVector::from_iterator(linear.count, each)
    };
    let least = sightings.cost_of(linear, &moved([0.0; 2]));
    let shared = |by: [f64; 2]| {
        let cost = sightings.cost_up_to(linear, &moved(by), least + NOTHING);
        let share = cost.map_or(0.0, |cost| libm::exp(least - cost));
        (by, share)
    };
    let shares = (-reach..=reach).into_par_iter().flat_map_iter(|a| {
        let ends = (-reach..=reach).map(move |b| [a, b]);
        ends.map(|ends| shared(ends.map(|n| STEP * f64::from(n))))
    });
    let shares: Vec<([f64; 2], f64)> = shares.collect();
    let (mut sum, mut all) = ([0.0; 2], 0.0);
    for (by, share) in shares {
        sum = [0, 1].map(|end| sum[end] + share * by[end]);
        all += share;
    }
    let mean = moved(sum.map(|sum| sum / all));
    // Likely lines on two sides of unlikely ones.
    if sightings.cost_of(linear, &mean) > least + WORSE {
        return likeliest.coefficients.clone();
    }
    mean
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
        let (first, last) = self.splines.knots.domain();
        self.at_ends[usize::from(along - first > last - along)]
    }

    fn knots(&self) -> Vec<f64> {
        let breaks = &self.splines.breaks;
        breaks[1..breaks.len() - 1].to_vec()
    }
}

impl Known {
    /// How well an amount is known.
    fn variance(&self, along: f64) -> f64 {
        let basis = self.splines.at(along, 0);
        let mut values = DVector::zeros(self.splines.count());
        for (row, value) in basis.values.iter().take(4).enumerate() {
            values[basis.first + row] = *value;
        }
        match self.information.clone().cholesky() {
            Some(solver) => values.dot(&solver.solve(&values)),
            None => BEFORE * BEFORE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::Layout;
    use super::super::likelihood::Sighting;
    use super::*;
    use crate::evidence::Seen;
    use nurbs::PiecewiseCubic;

    #[test]
    fn a_line_of_which_samples_tell_no_more_lies_amid_them() {
        let line = PiecewiseCubic::line([0.0, 0.0], [40.0, 0.0], 40.0).unwrap();
        let splines = Layout::of(&line, false).splines(1.0, 10).unwrap();
        // As along an axis of the grid: one row of samples is there, the next is not.
        let sighting = |(k, seen, inside): (i32, Seen, f64)| Sighting {
            along: f64::from(k) + 0.5,
            inside,
            place: [0.0; 2],
            seen,
        };
        let rows = (0..40).flat_map(|k| [(k, Seen::Present, 0.7), (k, Seen::Missing, -0.3)]);
        let sightings = Sightings::enough(rows.map(sighting).collect()).unwrap();
        let (_, sway, _) = Sway::of(&sightings, splines).unwrap();
        for along in [1.0, 20.0, 39.0] {
            // What is known before draws it towards where it was drawn, but little.
            assert!(
                (sway.at(along, 0) - 0.2).abs() < 0.03,
                "{}",
                sway.at(along, 0)
            );
        }
    }
}
