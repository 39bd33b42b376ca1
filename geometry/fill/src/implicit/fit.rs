//! Weights by the conditions.

use glam::DVec3;
use rayon::prelude::*;

use super::assemble::{self, Condition};
use super::dense::{Reflections, Square, Tridiagonal, dot, eliminate};
use super::fine::Fine;
use super::kernel::Kernel;
use super::thin::thinned;
use super::{Implicit, Sample};

/// How near the function comes to zero at the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smoothing {
    /// As near as makes the points likeliest.
    Likelihood,
    /// Exactly, however rough it becomes.
    Exact,
}

/// How weights are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// The most central points by orthogonal transformations, the rest by levels of compact support.
    Levels,
    /// All points at once by elimination with pivots, exactly (Yoo, section 3.1).
    Elimination,
}

/// How a function is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// The radial function.
    pub kernel: Kernel,
    /// How near to the points.
    pub smoothing: Smoothing,
    /// How weights are found.
    pub solver: Solver,
    /// Most points in the dense part of [`Solver::Levels`].
    pub most_centres: usize,
    /// Where slopes or points off the surface are conditions: at each how many-th of the points.
    pub every: usize,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            kernel: Kernel::Quintic,
            smoothing: Smoothing::Likelihood,
            solver: Solver::Levels,
            most_centres: 600,
            every: 3,
        }
    }
}

/// Why there is no function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplicitError {
    /// Fewer points than a surface takes.
    #[error("{count} points with normals are too few for an implicit surface")]
    TooFew {
        /// How many there are.
        count: usize,
    },
    /// A coordinate is not a number.
    #[error("a point or normal is not finite")]
    NotFinite,
    /// No weights satisfy the conditions.
    #[error("the points do not determine a function; some may coincide")]
    Singular,
}

/// How far off the surface the points of equation 4 are, of the distance to the next one.
const OFFSET: f64 = 0.5;
/// Variance of a slope over that of a value, in units of the region.
const SLOPE_VARIANCE: f64 = 100.0;
/// Ridges that are looked at, of the matrix's size: from nothing to all smoothed away.
const LEAST_RIDGE: f64 = 1e-16;
const MOST_RIDGE: f64 = 1e2;
const RIDGES: usize = 37;
const REFINEMENTS: usize = 24;
/// Points are averaged where their noise is above this, in units of the region, and where there are so
/// many times more of them than the dense part has; so often.
const NOISY: f64 = 1e-5;
const WORTH_AVERAGING: f64 = 1.5;
const AVERAGINGS: usize = 3;

impl Implicit {
    /// The function through samples; `size_mm` is that of the hole or region that it is wanted in.
    ///
    /// # Errors
    /// [`ImplicitError`] where the samples do not determine one.
    pub fn fit(
        samples: &[Sample],
        size_mm: f64,
        settings: &FitSettings,
    ) -> Result<Self, ImplicitError> {
        let is_finite = |own: &Sample| own.place_mm.is_finite() && own.normal.is_finite();
        if !(samples.iter().all(is_finite) && size_mm.is_finite() && size_mm > 0.0) {
            return Err(ImplicitError::NotFinite);
        }
        if samples.len() < 4 || samples.iter().all(|own| own.normal == DVec3::ZERO) {
            return Err(ImplicitError::TooFew {
                count: samples.len(),
            });
        }
        let sum: DVec3 = samples.iter().map(|own| own.place_mm).sum();
        let frame = Frame {
            origin_mm: sum / samples.len() as f64,
            unit_mm: size_mm,
        };
        match settings.solver {
            Solver::Levels => by_levels(samples, frame, settings),
            Solver::Elimination => by_elimination(samples, frame, settings),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Frame {
    origin_mm: DVec3,
    unit_mm: f64,
}

impl Frame {
    fn inside(&self, place_mm: DVec3) -> DVec3 {
        (place_mm - self.origin_mm) / self.unit_mm
    }

    fn assembled(
        &self,
        kernel: Kernel,
        conditions: &[Condition],
        weights: &[f64],
        polynomial: Vec<f64>,
    ) -> Implicit {
        let mut own = Implicit {
            kernel,
            origin_mm: self.origin_mm,
            unit_mm: self.unit_mm,
            values: Vec::new(),
            slopes: Vec::new(),
            polynomial,
            fine: Vec::new(),
            noise_mm: 0.0,
        };
        for (condition, &weight) in conditions.iter().zip(weights) {
            if condition.is_slope() {
                own.slopes.push((condition.at, condition.along * weight));
            } else {
                own.values.push((condition.at, weight));
            }
        }
        own
    }
}

/// Values at the points of these indices, and slopes or values off the surface at some of them.
fn conditions(
    samples: &[Sample],
    indices: &[usize],
    frame: Frame,
    settings: &FitSettings,
) -> Vec<Condition> {
    let value = |&k: &usize| Condition {
        at: frame.inside(samples[k].place_mm),
        along: DVec3::ZERO,
        wanted: 0.0,
        variance: 1.0,
    };
    let mut conditions: Vec<Condition> = indices.iter().map(value).collect();
    // Their order is such that every beginning of it is spread.
    let count = indices.len().div_ceil(settings.every.max(1)).max(4);
    let with_normal = indices
        .iter()
        .filter(|&&k| samples[k].normal != DVec3::ZERO);
    let points = conditions.len();
    for &k in with_normal.take(count) {
        let (at, along) = (frame.inside(samples[k].place_mm), samples[k].normal);
        if settings.kernel.takes_slopes() {
            conditions.push(Condition {
                at,
                along,
                wanted: 1.0,
                variance: SLOPE_VARIANCE,
            });
        } else {
            let others = conditions[..points].iter();
            let apart = others.map(|own| own.at.distance_squared(at));
            let nearest = apart.filter(|own| *own > 0.0).fold(1.0, f64::min).sqrt();
            let off = OFFSET * nearest;
            conditions.push(Condition {
                at: at + off * along,
                along: DVec3::ZERO,
                wanted: off,
                variance: 1.0,
            });
        }
    }
    conditions
}

fn by_levels(
    samples: &[Sample],
    frame: Frame,
    settings: &FitSettings,
) -> Result<Implicit, ImplicitError> {
    let indices = thinned(samples, frame.unit_mm, settings.most_centres);
    let mut conditions = conditions(samples, &indices, frame, settings);
    let (mut own, mut noise) =
        Dense::of(&conditions, frame, settings)?.solved(&conditions, settings)?;
    let is_averaged = settings.smoothing == Smoothing::Likelihood
        && noise > NOISY
        && samples.len() as f64 >= WORTH_AVERAGING * indices.len() as f64;
    if is_averaged {
        let nearest = nearest(samples, &indices);
        let mut counts = vec![0_u32; indices.len()];
        nearest.iter().for_each(|&k| counts[k] += 1);
        for (condition, &count) in conditions.iter_mut().zip(&counts) {
            condition.variance = 1.0 / f64::from(count.max(1));
        }
        let dense = Dense::of(&conditions, frame, settings)?;
        for _ in 0..AVERAGINGS {
            let value = |own: &Implicit, k: usize| own.at(samples[k].place_mm).0 / frame.unit_mm;
            let values: Vec<f64> = (0..samples.len())
                .into_par_iter()
                .map(|k| value(&own, k))
                .collect();
            let mut sums = vec![0.0; indices.len()];
            for (&cell, value) in nearest.iter().zip(&values) {
                sums[cell] += value;
            }
            for (k, &index) in indices.iter().enumerate() {
                conditions[k].wanted = values[index] - sums[k] / f64::from(counts[k].max(1));
            }
            (own, noise) = dense.solved(&conditions, settings)?;
        }
    }
    if samples.len() > indices.len() {
        let exact = settings.smoothing == Smoothing::Exact;
        let noise = if exact { 0.0 } else { noise };
        own.fine = Fine::levels(&own, samples, &indices, noise);
    }
    Ok(own)
}

/// For each sample the place among these indices of the one that is nearest.
fn nearest(samples: &[Sample], indices: &[usize]) -> Vec<usize> {
    let of = |own: &Sample| {
        let apart = |k: &usize| own.place_mm.distance_squared(samples[indices[*k]].place_mm);
        let all = (0..indices.len()).min_by(|a, b| apart(a).total_cmp(&apart(b)));
        all.unwrap_or(0)
    };
    samples.par_iter().with_min_len(64).map(of).collect()
}

/// The system of conditions, made ready for whatever is wanted.
struct Dense {
    frame: Frame,
    kernel: Kernel,
    reflections: Reflections,
    /// Upper rows of the matrix, which give the polynomial.
    head: Vec<Vec<f64>>,
    tridiagonal: Tridiagonal,
}

impl Dense {
    fn of(
        conditions: &[Condition],
        frame: Frame,
        settings: &FitSettings,
    ) -> Result<Self, ImplicitError> {
        let mut matrix = assemble::matrix(settings.kernel, conditions);
        let reflections = Reflections::of(assemble::columns(settings.kernel, conditions));
        let (size, rank) = (conditions.len(), reflections.rank());
        if size <= rank + 1 {
            return Err(ImplicitError::TooFew { count: size });
        }
        reflections.both_sides(&mut matrix);
        // What no polynomial explains.
        let rest = size - rank;
        let mut inner = Square::zero(rest);
        for (row, own) in inner.values.chunks_mut(rest).enumerate() {
            own.copy_from_slice(&matrix.row(rank + row)[rank..]);
        }
        Ok(Self {
            frame,
            kernel: settings.kernel,
            reflections,
            head: (0..rank).map(|k| matrix.row(k)[rank..].to_vec()).collect(),
            tridiagonal: Tridiagonal::of(inner),
        })
    }

    /// The function, and the standard deviation of points in units of the region.
    fn solved(
        &self,
        conditions: &[Condition],
        settings: &FitSettings,
    ) -> Result<(Implicit, f64), ImplicitError> {
        let (size, rank) = (conditions.len(), self.reflections.rank());
        let mut right = assemble::wanted(conditions);
        self.reflections.forward(&mut right);
        let mut turned = right[rank..].to_vec();
        self.tridiagonal.forward(&mut turned);
        let ridged =
            ridge(&self.tridiagonal, &turned, settings.smoothing).ok_or(ImplicitError::Singular)?;
        let mut weights = vec![0.0; size];
        weights[rank..].copy_from_slice(&ridged.solution);
        self.tridiagonal.back(&mut weights[rank..]);
        let head: Vec<f64> = self
            .head
            .iter()
            .zip(&right)
            .map(|(row, right)| right - dot(row, &weights[rank..]))
            .collect();
        let polynomial = self.reflections.solve_triangle(&head);
        self.reflections.back(&mut weights);
        assemble::unscaled(conditions, &mut weights);
        if !weights.iter().chain(&polynomial).all(|w| w.is_finite()) {
            return Err(ImplicitError::Singular);
        }
        let mut own = self
            .frame
            .assembled(self.kernel, conditions, &weights, polynomial);
        own.noise_mm = ridged.noise * self.frame.unit_mm;
        Ok((own, ridged.noise))
    }
}

struct Ridged {
    solution: Vec<f64>,
    /// Standard deviation of values, in units of the region.
    noise: f64,
}

/// The ridge under which what is wanted is likeliest, by restricted maximum likelihood: what is wanted
/// is taken as drawn with the matrix plus ridge as covariance, up to a factor.
fn ridge(matrix: &Tridiagonal, right: &[f64], smoothing: Smoothing) -> Option<Ridged> {
    let size = right.len() as f64;
    let largest = matrix.diagonal.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    let score = |log_ridge: f64| {
        let (solution, log) = matrix.solve(largest * libm::exp(log_ridge), right)?;
        let energy = dot(&solution, right);
        (energy > 0.0).then(|| size * libm::log(energy / size) + log)
    };
    let (least, most) = (libm::log(LEAST_RIDGE), libm::log(MOST_RIDGE));
    let step = (most - least) / (RIDGES - 1) as f64;
    let ridges = (0..RIDGES).map(|k| least + step * k as f64);
    let chosen = match smoothing {
        Smoothing::Exact => ridges.into_iter().find(|&own| score(own).is_some())?,
        Smoothing::Likelihood => {
            let scored = ridges.filter_map(|own| Some((score(own)?, own)));
            let (_, mut at) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
            let (mut low, mut high) = (at - step, at + step);
            for _ in 0..REFINEMENTS {
                let (a, b) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
                let worst = f64::INFINITY;
                if score(a).unwrap_or(worst) <= score(b).unwrap_or(worst) {
                    (high, at) = (b, a);
                } else {
                    (low, at) = (a, b);
                }
            }
            at
        }
    };
    let ridge = largest * libm::exp(chosen);
    let (solution, _) = matrix.solve(ridge, right)?;
    let energy = dot(&solution, right).max(0.0);
    Some(Ridged {
        noise: (ridge * energy / size).sqrt(),
        solution,
    })
}

/// The whole system at once, bordered by the polynomial (equation 4).
fn by_elimination(
    samples: &[Sample],
    frame: Frame,
    settings: &FitSettings,
) -> Result<Implicit, ImplicitError> {
    let indices = thinned(samples, frame.unit_mm, samples.len());
    let conditions = conditions(samples, &indices, frame, settings);
    let matrix = assemble::matrix(settings.kernel, &conditions);
    let columns = assemble::columns(settings.kernel, &conditions);
    let size = conditions.len();
    let mut whole = Square::zero(size + columns.len());
    for (row, own) in whole.values.chunks_mut(size + columns.len()).enumerate() {
        if row < size {
            own[..size].copy_from_slice(matrix.row(row));
            for (value, column) in own[size..].iter_mut().zip(&columns) {
                *value = column[row];
            }
        } else {
            own[..size].copy_from_slice(&columns[row - size]);
        }
    }
    let mut right = assemble::wanted(&conditions);
    right.resize(size + columns.len(), 0.0);
    let mut weights = eliminate(whole, right).ok_or(ImplicitError::Singular)?;
    let polynomial = weights.split_off(size);
    assemble::unscaled(&conditions, &mut weights);
    Ok(frame.assembled(settings.kernel, &conditions, &weights, polynomial))
}
