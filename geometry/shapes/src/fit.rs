//! A shape of a given family fitted to samples.

use std::borrow::Cow;

use nalgebra::{SMatrix, SVector, Vector3};

use crate::jet::{Jet, MOST_FREE};
use crate::local::Local;
use crate::robust;
use crate::shape::{Family, Shape};
use crate::spread::spread;
use crate::start::starts;
use crate::uncertainty::{Numbers, numbers};

/// A point of a surface, as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The point in the part frame, millimetres.
    pub point_mm: Vector3<f64>,
    /// Unit direction of the ray that measured it, either way: its noise lies along the ray. On
    /// a slope that is not along the normal, and noise that moves samples down a slope would tilt
    /// it if distances along the normal were what counts.
    pub ray: Vector3<f64>,
    /// Standard deviation along the ray, millimetres.
    pub sigma_mm: f64,
}

/// Deviation of samples across their rays, of that along them: what keeps rays that graze a
/// shape from counting without bound.
pub(crate) const ACROSS: f64 = 0.05;

/// A fitted shape.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The shape.
    pub shape: Shape,
    /// Root mean square distance of the samples held, along the normal, millimetres.
    pub rms_mm: f64,
    /// Samples that the shape rests on; the rest lie too far off to be noise.
    pub held: usize,
    /// Its numbers and how well they are known.
    pub numbers: Numbers,
    local: Local,
}

impl Fit {
    /// How far a sample lies off the shape along its ray, in its standard deviations.
    #[must_use]
    pub fn off(&self, sample: &Sample) -> f64 {
        off(&self.local, sample)
    }
}

/// Samples that starts are tried on, at most.
const TRIED: usize = 300;
/// Rounds of weighing samples in such a trial and steps in each, and steps in the fit itself.
const TRIALS: usize = 10;
const TRIAL_STEPS: usize = 6;
const STEPS: usize = 40;
/// Robust scales at which a sample weighs half in a trial.
const WIDE: f64 = 2.0;
/// Starts that are followed to their end, and the samples they are followed on, at most; all
/// samples decide only where the best of them ends.
const FOLLOWED: usize = 2;
const FOLLOWED_ON: usize = 2000;
/// Rounds of deciding which samples are held.
const ROUNDS: usize = 3;
/// A radius beyond so many times the samples' extent is no radius.
const FLATTEST: f64 = 1e3;
/// Relative change of the cost at which a fit has ended.
const ENDED: f64 = 1e-7;

/// Fits a shape of this family. `area` tells how many samples together say as much as one
/// whose noise is its own: 1 for raw samples, more for the nodes of a regridded image.
/// `None` where there are too few samples, or the surface is too flat to be of this family.
#[must_use]
pub fn fit(family: Family, samples: &[Sample], area: f64) -> Option<Fit> {
    if samples.len() <= family.freedom() {
        return None;
    }
    let few = some_of(samples, TRIED);
    let mut tried: Vec<(f64, Local)> = starts(family, samples)?
        .into_iter()
        .filter_map(|start| {
            let local = tried_on(start, &few)?;
            Some((scale(&local, &few), local))
        })
        .collect();
    // Stable, so that of equals the first stays first.
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let some = some_of(samples, FOLLOWED_ON);
    let local = tried
        .into_iter()
        .take(FOLLOWED)
        .filter_map(|(_, local)| {
            let local = settled(local, &some)?;
            Some((scale(&local, &some), local))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, local)| local)?;
    if some.len() < samples.len() {
        told(settled(local, samples)?, samples, area)
    } else {
        told(local, samples, area)
    }
}

/// At most so many of the samples, from everywhere.
fn some_of(samples: &[Sample], most: usize) -> Cow<'_, [Sample]> {
    if samples.len() <= most {
        return Cow::Borrowed(samples);
    }
    let taken = spread(samples.len(), most);
    taken.map(|index| samples[index]).collect()
}

/// Follows a start for a while, the less drawn by a sample the farther off it lies.
fn tried_on(mut local: Local, samples: &[Sample]) -> Option<Local> {
    let mut weights = vec![1.0; samples.len()];
    for _ in 0..TRIALS {
        let wide = WIDE * scale(&local, samples).max(f64::MIN_POSITIVE);
        for (weight, sample) in weights.iter_mut().zip(samples) {
            *weight = (1.0 + (off(&local, sample) / wide).powi(2)).recip();
        }
        local = descend(local, samples, &weights, TRIAL_STEPS)?;
    }
    Some(local)
}

/// Follows a start to its end.
fn settled(mut local: Local, samples: &[Sample]) -> Option<Local> {
    for _ in 0..ROUNDS {
        let held = held(&local, samples);
        local = descend(local, samples, &held, STEPS)?;
    }
    Some(local)
}

/// The samples that are not too far off, as weights.
fn held(local: &Local, samples: &[Sample]) -> Vec<f64> {
    robust::held(samples.iter().map(|sample| off(local, sample)))
}

/// A fit that has ended, with all there is to say of it.
fn told(local: Local, samples: &[Sample], area: f64) -> Option<Fit> {
    let extent_mm = extent_mm(samples);
    let shape = local.shape().filter(|shape| is_sound(shape, extent_mm))?;
    let held = held(&local, samples);
    let (mut squares, mut squares_mm2, mut count) = (0.0, 0.0, 0_usize);
    for (sample, _) in samples.iter().zip(&held).filter(|(_, held)| **held > 0.0) {
        let off = off(&local, sample);
        squares += off * off;
        squares_mm2 += local.distance::<f64>(&sample.point_mm).powi(2);
        count += 1;
    }
    let free = local.free();
    let left = count.checked_sub(free.len()).filter(|left| *left > 0)? as f64;
    let (normal, _) = normal_equations(&local, samples, &held);
    let covariance = normal.cholesky()?.inverse() * (squares / left * area.max(1.0));
    Some(Fit {
        shape,
        rms_mm: (squares_mm2 / count as f64).sqrt(),
        held: count,
        numbers: numbers(&local, &covariance)?,
        local,
    })
}

/// Radii that say nothing are none.
fn is_sound(shape: &Shape, extent_mm: f64) -> bool {
    let most = FLATTEST * extent_mm;
    match shape {
        Shape::Plane(_) => true,
        Shape::Sphere(sphere) => sphere.radius_mm < most,
        Shape::Cylinder(cylinder) => cylinder.radius_mm < most,
        Shape::Cone(cone) => {
            cone.half_angle_rad < core::f64::consts::FRAC_PI_2
                && cone.half_angle_rad > 1.0 / FLATTEST
        }
        Shape::Torus(torus) => {
            torus.radius_mm < most && torus.tube_mm < most && torus.radius_mm > 1e-3 * torus.tube_mm
        }
    }
}

fn extent_mm(samples: &[Sample]) -> f64 {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for sample in samples {
        low = low.inf(&sample.point_mm);
        high = high.sup(&sample.point_mm);
    }
    (high - low).norm()
}

fn off(local: &Local, sample: &Sample) -> f64 {
    local.off(sample)
}

/// The standard deviation of the distances, in those of the samples, by their median.
fn scale(local: &Local, samples: &[Sample]) -> f64 {
    robust::deviation(samples.iter().map(|sample| off(local, sample)))
}

type Matrix = SMatrix<f64, MOST_FREE, MOST_FREE>;
type Step = SVector<f64, MOST_FREE>;

/// Squared distances of the samples in their variances, each with its weight.
fn cost(local: &Local, samples: &[Sample], weights: &[f64]) -> f64 {
    let weighed = samples.iter().zip(weights);
    weighed
        .map(|(sample, weight)| weight * off(local, sample).powi(2))
        .sum()
}

/// The normal equations of the least squares at a shape; numbers that are not free stay.
fn normal_equations(local: &Local, samples: &[Sample], weights: &[f64]) -> (Matrix, Step) {
    let (mut matrix, mut right) = (Matrix::zeros(), Step::zeros());
    let free = local.free();
    for (sample, weight) in samples
        .iter()
        .zip(weights)
        .filter(|(_, weight)| **weight > 0.0)
    {
        let off: Jet = local.off(sample);
        for &i in free {
            right[i] -= weight * off.by[i] * off.value;
            for &j in free.iter().take_while(|j| **j <= i) {
                matrix[(i, j)] += weight * off.by[i] * off.by[j];
            }
        }
    }
    for i in 0..MOST_FREE {
        if !free.contains(&i) {
            matrix[(i, i)] = 1.0;
        }
        for j in 0..i {
            matrix[(j, i)] = matrix[(i, j)];
        }
    }
    (matrix, right)
}

/// Levenberg and Marquardt's descent. `None` where the numbers leave what is finite.
fn descend(mut local: Local, samples: &[Sample], weights: &[f64], steps: usize) -> Option<Local> {
    let mut damping = 1e-3;
    let mut least = cost(&local, samples, weights);
    if !least.is_finite() {
        return None;
    }
    for _ in 0..steps {
        let (matrix, right) = normal_equations(&local, samples, weights);
        let mut next = None;
        while next.is_none() && damping < 1e9 {
            let mut damped = matrix;
            for k in 0..MOST_FREE {
                damped[(k, k)] *= 1.0 + damping;
            }
            let moved = damped
                .cholesky()
                .map(|factors| local.moved(&factors.solve(&right).into()))
                .map(|moved| (cost(&moved, samples, weights), moved))
                .filter(|(cost, _)| *cost <= least);
            match moved {
                Some(found) => {
                    damping = (damping * 0.1).max(1e-12);
                    next = Some(found);
                }
                None => damping *= 10.0,
            }
        }
        let Some((cost, moved)) = next else { break };
        let ended = least - cost <= ENDED * least;
        (local, least) = (moved, cost);
        if ended {
            break;
        }
    }
    Some(local)
}
