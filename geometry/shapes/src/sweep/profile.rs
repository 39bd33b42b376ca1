//! A profile as a spline, by least squares.

use nurbs::{BandedMatrix, KnotVector, PiecewiseCubic};

use super::motion::{Placed, Sweep};
use crate::fit::Sample;
use crate::robust;

const DEGREE: usize = 3;
/// Rounds of weighing samples by how far they are off, as trials of fits do, and of holding those
/// that may be noise.
const ROUNDS: usize = 4;
const ROUNDS_HELD: usize = 2;
/// Robust scales at which a sample weighs half.
const WIDE: f64 = 2.0;
/// What is added to what samples tell of a coefficient, of what they tell of the mean one: a span
/// without samples goes on from its neighbours.
const STIFFNESS: f64 = 1e-7;
/// A profile goes on straight beyond what was seen of it by this share of its length.
const BEYOND: f64 = 0.1;

/// A spline and how far the samples are off it.
pub(super) struct Spline {
    pub(super) placed: Vec<Placed>,
    pub(super) knots: KnotVector,
    coefficients: Vec<f64>,
    /// Of each sample along its ray, in its deviations.
    pub(super) offs: Vec<f64>,
    /// Slope of the profile beside it.
    pub(super) slopes: Vec<f64>,
    /// Those that may be noise, as weights 0 and 1.
    pub(super) held: Vec<f64>,
}

impl Spline {
    /// The best profile of so many spans for a motion. `None` where the samples do not tell it.
    pub(super) fn of(sweep: &Sweep, samples: &[Sample], spans: usize) -> Option<Self> {
        let mut spline = Self::empty(sweep, samples, spans)?;
        for round in 0..ROUNDS + ROUNDS_HELD {
            spline.solve(samples)?;
            spline.look(samples);
            spline.held = if round + 1 < ROUNDS {
                let wide = WIDE * robust::deviation(spline.offs.iter().copied());
                let wide = wide.max(f64::MIN_POSITIVE);
                let weights = spline
                    .offs
                    .iter()
                    .map(|off| (1.0 + (off / wide).powi(2)).recip());
                weights.collect()
            } else {
                robust::held(spline.offs.iter().copied())
            };
        }
        Some(spline)
    }

    /// That for a motion near to the one that this is for.
    pub(super) fn beside(&self, sweep: &Sweep, samples: &[Sample]) -> Option<Self> {
        let spans = self.knots.control_count() - DEGREE;
        let mut spline = Self {
            slopes: self.slopes.clone(),
            held: self.held.clone(),
            ..Self::empty(sweep, samples, spans)?
        };
        for _ in 0..ROUNDS_HELD {
            spline.solve(samples)?;
            spline.look(samples);
            spline.held = robust::held(spline.offs.iter().copied());
        }
        Some(spline)
    }

    fn empty(sweep: &Sweep, samples: &[Sample], spans: usize) -> Option<Self> {
        let placed: Vec<Placed> = samples.iter().map(|s| sweep.place(&s.point_mm)).collect();
        let s_mm = || placed.iter().map(|placed| placed.s_mm);
        let low = s_mm().fold(f64::INFINITY, f64::min);
        let high = s_mm().fold(f64::NEG_INFINITY, f64::max);
        let knots = KnotVector::uniform(DEGREE, spans, low, high).ok()?;
        Some(Self {
            coefficients: vec![0.0; knots.control_count()],
            offs: Vec::new(),
            slopes: vec![0.0; samples.len()],
            held: vec![1.0; samples.len()],
            placed,
            knots,
        })
    }

    /// Least squares with the weights and slopes as they are.
    fn solve(&mut self, samples: &[Sample]) -> Option<()> {
        let count = self.coefficients.len();
        let mut matrix = BandedMatrix::zero(count, DEGREE);
        let mut right = vec![0.0; count];
        let each = self.placed.iter().zip(samples);
        for ((placed, sample), (slope, held)) in each.zip(self.slopes.iter().zip(&self.held)) {
            let deviation_mm = sample.deviation_mm(&placed.normal(*slope));
            let weight = held / (deviation_mm * deviation_mm * (1.0 + slope * slope));
            let basis = self.knots.basis(placed.s_mm);
            for (i, of_row) in basis.values[..=DEGREE].iter().enumerate() {
                right[basis.first + i] += weight * of_row * placed.t_mm;
                for (j, of_column) in basis.values[..=i].iter().enumerate() {
                    matrix.add(
                        basis.first + i,
                        basis.first + j,
                        weight * of_row * of_column,
                    );
                }
            }
        }
        let stiffness = STIFFNESS * matrix.trace() / count as f64;
        for k in 0..count.saturating_sub(2) {
            let bend = [1.0, -2.0, 1.0];
            for i in 0..3 {
                for j in 0..=i {
                    matrix.add(k + i, k + j, stiffness * bend[i] * bend[j]);
                }
            }
        }
        matrix.cholesky().ok()?.solve(&mut right);
        self.coefficients = right;
        Some(())
    }

    /// How far the samples are off, and the slopes beside them.
    fn look(&mut self, samples: &[Sample]) {
        let value = |s_mm: f64, order: usize| self.value(s_mm, order);
        let slopes = self.placed.iter().map(|placed| value(placed.s_mm, 1));
        let slopes: Vec<f64> = slopes.collect();
        let each = self.placed.iter().zip(samples).zip(&slopes);
        let offs = each.map(|((placed, sample), slope)| {
            let off_mm = (placed.t_mm - value(placed.s_mm, 0)) / (1.0 + slope * slope).sqrt();
            off_mm / sample.deviation_mm(&placed.normal(*slope))
        });
        self.offs = offs.collect();
        self.slopes = slopes;
    }

    fn value(&self, s_mm: f64, order: usize) -> f64 {
        let basis = self.knots.basis_derivative(s_mm, order);
        let own = basis.values[..=DEGREE]
            .iter()
            .zip(&self.coefficients[basis.first..]);
        own.map(|(basis, coefficient)| basis * coefficient).sum()
    }

    /// How far along the profile samples reach, millimetres.
    pub(super) fn length_mm(&self) -> f64 {
        let (first, last) = self.knots.domain();
        last - first
    }

    /// Sum of the squares of what is held.
    pub(super) fn squares(&self) -> f64 {
        let all = self.offs.iter().zip(&self.held);
        all.map(|(off, held)| held * off * off).sum()
    }

    /// Standard deviation of the samples about it, in what they are said to have.
    pub(super) fn deviation(&self) -> f64 {
        robust::deviation(self.offs.iter().copied())
    }

    /// The same as pieces, with a straight one at either end. A radius goes down to the axis at most.
    pub(super) fn pieces(&self, sweep: &Sweep) -> PiecewiseCubic<1> {
        let breaks = self.knots.breaks();
        let factorials = [1.0, 1.0, 2.0, 6.0];
        let piece = |s_mm: f64| {
            let of = |order: usize| self.value(s_mm, order) / factorials[order];
            [core::array::from_fn(of)]
        };
        let (first, last) = self.knots.domain();
        let beyond_mm = BEYOND * (last - first);
        let before_mm = if sweep.has_radius_along() {
            beyond_mm.min(first / 2.0)
        } else {
            beyond_mm
        };
        let straight = |at_mm: f64, from_mm: f64| {
            let (value, slope) = (self.value(at_mm, 0), self.value(at_mm, 1));
            [[value + slope * (from_mm - at_mm), slope, 0.0, 0.0]]
        };
        let mut all = PiecewiseCubic {
            breaks: Vec::new(),
            pieces: Vec::new(),
        };
        if before_mm > 0.0 {
            all.breaks.push(first - before_mm);
            all.pieces.push(straight(first, first - before_mm));
        }
        all.breaks.extend(&breaks);
        all.pieces
            .extend(breaks[..breaks.len() - 1].iter().map(|s_mm| piece(*s_mm)));
        all.breaks.push(last + beyond_mm);
        all.pieces.push(straight(last, last));
        all
    }
}
