//! Motion and profile fitted to samples together.

use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};

use super::motion::{MOST_FREE, Motion, Sweep};
use super::profile::Spline;
use super::surface::Swept;
use crate::fit::Sample;
use crate::spread::spread;
use crate::uncertainty::Spread;

/// Most of a turn in one step, radians: farther, slopes are others.
const MOST_TURN: f64 = 0.1;
/// Times that a step which makes nothing better is halved.
const HALVINGS: usize = 4;
/// Relative change of the squares at which a fit has ended.
const ENDED: f64 = 1e-6;
/// What is added to a number that the samples hardly tell, of what they tell of it beside others.
const DAMPING: f64 = 1e-9;
const DEGREE: usize = 3;
/// Samples by which a motion is told, and steps with them.
const MANY: usize = 20_000;
pub(super) const STEPS: usize = 6;

/// A fitted surface of extrusion or revolution.
#[derive(Debug, Clone)]
pub struct SweptFit {
    /// The surface.
    pub swept: Swept,
    /// How many numbers it was given: those of its motion, and the coefficients of its profile.
    pub freedom: usize,
    /// Root mean square distance of the samples held, along the normal, millimetres.
    pub rms_mm: f64,
    /// Samples that it rests on; the rest lie too far off to be noise.
    pub held: usize,
    /// How the direction of extrusion or the axis may be off, radians.
    pub direction_rad: Spread,
    /// How the axis of a revolution may be off across itself beside the middle of the samples,
    /// millimetres.
    pub place_mm: Option<Spread>,
    /// Length of a span of its profile, millimetres.
    pub span_mm: f64,
    /// Root mean square of the profile's standard deviation along its normal, beside the samples,
    /// millimetres.
    pub profile_deviation_mm: f64,
}

impl SweptFit {
    /// The same surface by more samples, its profile as long as they reach. `area` is that of
    /// [`crate::fit`].
    #[must_use]
    pub fn again(&self, samples: &[Sample], area: f64) -> Option<Self> {
        let many: Vec<Sample> = spread(samples.len(), MANY).map(|k| samples[k]).collect();
        let sweep = &self.swept.sweep;
        let length_mm = Spline::of(sweep, &many, 1)?.length_mm();
        let spans = (length_mm / self.span_mm).ceil() as usize;
        Fitted::of(sweep, &many, spans, STEPS)?.told(&many, area)
    }
}

/// A motion, its profile, and what they leave.
pub(super) struct Fitted {
    pub(super) sweep: Sweep,
    pub(super) spline: Spline,
}

impl Fitted {
    /// The motion nearest to this one and the profile of so many spans that samples ask for, after at
    /// most so many steps.
    pub(super) fn of(
        sweep: &Sweep,
        samples: &[Sample],
        spans: usize,
        steps: usize,
    ) -> Option<Self> {
        let mut now = Self {
            spline: Spline::of(sweep, samples, spans)?,
            sweep: *sweep,
        };
        for _ in 0..steps {
            let Some(mut step) = now.step(samples) else {
                break;
            };
            let mut better = None;
            for _ in 0..HALVINGS {
                let next = now.sweep.moved(&step);
                let next = next.and_then(|sweep| now.beside(sweep, samples));
                better = next.filter(|next| next.cost() < now.cost());
                if better.is_some() {
                    break;
                }
                step = step.map(|number| 0.5 * number);
            }
            let Some(better) = better else { break };
            let has_ended = better.cost() > (1.0 - ENDED) * now.cost();
            now = better;
            if has_ended {
                break;
            }
        }
        Some(now)
    }

    fn beside(&self, sweep: Sweep, samples: &[Sample]) -> Option<Self> {
        let spline = self.spline.beside(&sweep, samples)?;
        Some(Self { sweep, spline })
    }

    /// What samples leave, each as much as the robust scale of all allows.
    fn cost(&self) -> f64 {
        let most = 4.0 * self.spline.deviation();
        let squares = self.spline.offs.iter();
        let squares = squares.map(|off| off.abs().min(most).powi(2));
        squares.sum::<f64>() / self.spline.offs.len() as f64
    }

    pub(super) fn freedom(&self) -> usize {
        self.sweep.freedom() + self.spline.knots.control_count()
    }

    /// Normal equations of motion and profile, motion first, and their right side.
    fn equations(&self, samples: &[Sample]) -> (DMatrix<f64>, DVector<f64>) {
        let (free, size) = (self.sweep.freedom(), self.freedom());
        let mut matrix = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        let spline = &self.spline;
        for (k, sample) in samples.iter().enumerate() {
            if spline.held[k] == 0.0 {
                continue;
            }
            let (placed, slope) = (&spline.placed[k], spline.slopes[k]);
            let rise = (1.0 + slope * slope).sqrt();
            let per_mm = (rise * sample.deviation_mm(&placed.normal(slope))).recip();
            let mut terms = [(0, 0.0); MOST_FREE + DEGREE + 1];
            let changes = self.sweep.changes(&sample.point_mm);
            for (k, (s, t)) in changes.into_iter().enumerate().take(free) {
                terms[k] = (k, per_mm * (t - slope * s));
            }
            let basis = spline.knots.basis(placed.s_mm);
            for (k, value) in basis.values[..=DEGREE].iter().enumerate() {
                terms[free + k] = (free + basis.first + k, -per_mm * value);
            }
            let terms = &terms[..free + DEGREE + 1];
            for (i, &(row, of_row)) in terms.iter().enumerate() {
                right[row] -= of_row * spline.offs[k];
                for &(column, of_column) in &terms[..=i] {
                    matrix[(row, column)] += of_row * of_column;
                }
            }
        }
        (matrix, right)
    }

    /// The step of the motion's numbers that they ask for.
    fn step(&self, samples: &[Sample]) -> Option<[f64; MOST_FREE]> {
        let (matrix, right) = self.equations(samples);
        let (scale, factors) = factors(matrix)?;
        let solved = factors
            .solve(&right.component_mul(&scale))
            .component_mul(&scale);
        let mut step = [0.0; MOST_FREE];
        for (number, solved) in step.iter_mut().zip(&solved).take(self.sweep.freedom()) {
            *number = *solved;
        }
        let turn = step[0].abs().max(step[1].abs());
        let share = (MOST_TURN / turn.max(f64::MIN_POSITIVE)).min(1.0);
        step.iter()
            .all(|number| number.is_finite())
            .then(|| step.map(|number| share * number))
    }

    /// The surface with all there is to say of it. `area` is that of [`crate::fit`].
    pub(super) fn told(self, samples: &[Sample], area: f64) -> Option<SweptFit> {
        let held = || self.spline.held.iter().filter(|held| **held > 0.0);
        let (count, freedom) = (held().count(), self.freedom());
        let left = count.checked_sub(freedom).filter(|left| *left > 0)? as f64;
        let middle = samples
            .iter()
            .map(|sample| sample.point_mm)
            .sum::<Vector3<f64>>();
        let sweep = self.sweep.beside(&(middle / samples.len() as f64));
        let own = self.beside(sweep, samples)?;
        let (matrix, _) = own.equations(samples);
        let (scale, factors) = factors(matrix)?;
        let variance = own.spline.squares() / left * area.max(1.0);
        let mut covariance = factors.inverse() * variance;
        for (i, of_row) in scale.iter().enumerate() {
            covariance.row_mut(i).scale_mut(*of_row);
            covariance.column_mut(i).scale_mut(*of_row);
        }
        let ways = sweep.across();
        let spread = |first: usize| {
            let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let of = |(i, j): (usize, usize)| {
                ways[i] * ways[j].transpose() * covariance[(first + i, first + j)]
            };
            Spread {
                covariance: pairs.into_iter().map(of).sum::<Matrix3<f64>>(),
            }
        };
        let (mut squares_mm2, mut variances_mm2) = (0.0, 0.0);
        let spline = &own.spline;
        for (k, sample) in samples.iter().enumerate() {
            if spline.held[k] == 0.0 {
                continue;
            }
            let (placed, slope) = (&spline.placed[k], spline.slopes[k]);
            let off_mm = spline.offs[k] * sample.deviation_mm(&placed.normal(slope));
            squares_mm2 += off_mm * off_mm;
            let basis = spline.knots.basis(placed.s_mm);
            let first = sweep.freedom() + basis.first;
            let values =
                SVector::<f64, { DEGREE + 1 }>::from_column_slice(&basis.values[..=DEGREE]);
            let of_these = covariance.fixed_view::<{ DEGREE + 1 }, { DEGREE + 1 }>(first, first);
            variances_mm2 += values.dot(&(of_these * values)) / (1.0 + slope * slope);
        }
        let up = |k: usize| spline.placed[k].normal(spline.slopes[k]).z > 0.0;
        let seen = (0..samples.len()).filter(|k| up(*k)).count();
        Some(SweptFit {
            swept: Swept {
                sweep,
                profile: spline.pieces(&sweep),
                is_hollow: 2 * seen < samples.len(),
            },
            freedom,
            rms_mm: (squares_mm2 / count as f64).sqrt(),
            held: count,
            direction_rad: spread(0),
            place_mm: (sweep.motion == Motion::Revolution).then(|| spread(2)),
            span_mm: spline.length_mm() / self.spans() as f64,
            profile_deviation_mm: (variances_mm2 / count as f64).sqrt(),
        })
    }

    fn spans(&self) -> usize {
        self.spline.knots.control_count() - DEGREE
    }
}

/// Factors of a matrix whose diagonal is scaled to 1, and the scale.
fn factors(matrix: DMatrix<f64>) -> Option<(DVector<f64>, nalgebra::Cholesky<f64, nalgebra::Dyn>)> {
    let diagonal = |k: usize| matrix[(k, k)].max(1e-300).sqrt().recip();
    let scale = DVector::from_fn(matrix.nrows(), |k, _| diagonal(k));
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        let damping = if i == j { DAMPING } else { 0.0 };
        // The lower half is all that the factors are made from.
        matrix[(i.max(j), i.min(j))] * scale[i] * scale[j] + damping
    });
    Some((scale, scaled.cholesky()?))
}
