//! A shape of a given family fitted to samples.

use std::borrow::Cow;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::descent::{Distance, Equations, Off, descend};
use crate::local::Local;
use crate::robust;
use crate::shape::{Family, Shape};
use crate::spread::spread;
use crate::start::Middle;
use crate::uncertainty::{Joint, Numbers, joint, numbers};

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

impl Sample {
    /// How far it lies off a shape along its ray, in its standard deviations, positive on the
    /// side that was seen: what fits make least.
    #[must_use]
    pub fn off(&self, shape: &Shape) -> f64 {
        let deviation_mm = self.deviation_mm(&shape.normal(&self.point_mm));
        shape.distance_mm(&self.point_mm) / deviation_mm
    }

    /// Its standard deviation along the unit normal of a surface, millimetres.
    #[must_use]
    pub fn deviation_mm(&self, normal: &Vector3<f64>) -> f64 {
        let covered = normal.dot(&self.ray);
        (covered * covered + ACROSS * ACROSS).sqrt() * self.sigma_mm
    }
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
    deviation: f64,
    joint: Joint,
    local: Local,
}

impl Fit {
    /// The shape of the same family nearest to this one that samples ask for. `area` is that of
    /// [`fit`]. `None` as there.
    #[must_use]
    pub fn again(&self, samples: &[Sample], area: f64) -> Option<Self> {
        if samples.len() <= self.shape.family().freedom() {
            return None;
        }
        told(settled(self.local, samples)?, samples, area)
    }

    /// Standard deviation of the samples held about the shape, in what they are said to have.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// Covariance of all the numbers, which [`Fit::numbers`] tells one by one.
    #[must_use]
    pub fn joint(&self) -> &Joint {
        &self.joint
    }

    /// How far samples lie off the shape along their rays, in their standard deviations.
    pub fn offs(&self, samples: &[Sample]) -> impl Iterator<Item = f64> {
        self.local.offs(samples)
    }
}

/// Trials by which starts are sifted, where there are many: those that it leads nearest to the
/// samples remain. Tori have forty, and few of them lead anywhere.
const SIEVES: [Trial; 2] = [
    Trial {
        samples: 100,
        rounds: 1,
        steps: 4,
    },
    Trial {
        samples: 100,
        rounds: 3,
        steps: 4,
    },
];
/// How many starts remain after each of the [`SIEVES`]; of tori the best is not always among the
/// first five of the last.
pub(crate) type Sieved = [usize; 2];
pub(crate) const FEW: Sieved = [20, 5];
pub(crate) const MANY: Sieved = [20, 10];
/// The trial of those that remain.
const LAST_TRIAL: Trial = Trial {
    samples: 300,
    rounds: 10,
    steps: 3,
};
/// Starts that leave the same in the last trial, but for this share, have come to the same.
const SAME: f64 = 1e-3;
/// Steps of a fit in each round.
const STEPS: usize = 40;
/// Robust scales at which a sample weighs half in a trial.
const WIDE: f64 = 2.0;
/// Change of that scale, relative, at which a trial has ended.
const STEADY: f64 = 1e-3;
/// Starts that are followed to their end, and the samples they are followed on, at most; all
/// samples decide only where the best of them ends.
const FOLLOWED: usize = 2;
const FOLLOWED_ON: usize = 600;
/// Rounds of deciding which samples are held.
const ROUNDS: usize = 3;
/// A radius beyond so many times the samples' extent is no radius.
const FLATTEST: f64 = 1e3;
/// Relative change of the cost at which a fit has ended, and at which a round of a trial has.
const ENDED: f64 = 1e-7;
const TRIAL_ENDED: f64 = 1e-3;

/// Fits a shape of this family. `area` tells how many samples together say as much as one
/// whose noise is its own: 1 for raw samples, more for the nodes of a regridded image.
/// `None` where there are too few samples, or the surface is too flat to be of this family.
#[must_use]
pub fn fit(family: Family, samples: &[Sample], area: f64) -> Option<Fit> {
    let found = found(family, samples, &Middle::of(samples)?, FEW)?;
    finished(found, samples, area)
}

/// Where the descent from the best of the starts ends on some of the samples, with their middle.
pub(crate) fn found(
    family: Family,
    samples: &[Sample],
    middle: &Middle,
    sieved: Sieved,
) -> Option<Local> {
    if samples.len() <= family.freedom() {
        return None;
    }
    let mut tried = middle.starts(family, samples);
    for (trial, most) in SIEVES.iter().zip(sieved) {
        if tried.len() > most {
            let led = trial.of(tried, samples).into_iter();
            tried = led.take(most).map(|(_, local)| local).collect();
        }
    }
    let mut tried = LAST_TRIAL.of(tried, samples);
    tried.truncate(FOLLOWED);
    let least = tried.first()?.0;
    tried.dedup_by(|other, _| other.0 <= (1.0 + SAME) * least);
    let some = some_of(samples, FOLLOWED_ON);
    let followed = tried.into_par_iter().filter_map(|(_, local)| {
        let local = settled(local, &some)?;
        Some((scale(&local, &some), local))
    });
    let followed: Vec<_> = followed.collect();
    followed
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, local)| local)
}

/// Fits what was found to all samples.
pub(crate) fn finished(found: Local, samples: &[Sample], area: f64) -> Option<Fit> {
    let local = if samples.len() > FOLLOWED_ON {
        settled(found, samples)?
    } else {
        found
    };
    told(local, samples, area)
}

/// At most so many of the samples, from everywhere.
fn some_of(samples: &[Sample], most: usize) -> Cow<'_, [Sample]> {
    if samples.len() <= most {
        return Cow::Borrowed(samples);
    }
    let taken = spread(samples.len(), most);
    taken.map(|index| samples[index]).collect()
}

/// What starts are tried with.
struct Trial {
    /// Samples, at most.
    samples: usize,
    /// Rounds of weighing them.
    rounds: usize,
    /// Steps in each round, at most.
    steps: usize,
}

impl Trial {
    /// Where the starts lead, with what they leave, the best first.
    fn of(&self, starts: Vec<Local>, samples: &[Sample]) -> Vec<(f64, Local)> {
        let few = some_of(samples, self.samples);
        let led = starts
            .into_par_iter()
            .filter_map(|start| self.lead(start, &few));
        let mut led: Vec<_> = led.collect();
        // Stable, so that of equals the first stays first.
        led.sort_by(|a, b| a.0.total_cmp(&b.0));
        led
    }

    /// Follows a start for a while, the less drawn by a sample the farther off it lies.
    fn lead(&self, mut local: Local, samples: &[Sample]) -> Option<(f64, Local)> {
        let mut weights = vec![1.0; samples.len()];
        let mut before = f64::INFINITY;
        for round in 0..=self.rounds {
            let distances = local.distances();
            let about: Vec<_> = samples.iter().map(|s| distances.about(s)).collect();
            let offs = about
                .iter()
                .map(|(distance_mm, deviation_mm)| distance_mm / deviation_mm);
            let now = robust::deviation(offs.clone());
            let is_steady = round > 0 && (now - before).abs() <= STEADY * before;
            before = now;
            if is_steady || round == self.rounds {
                break;
            }
            let wide = WIDE * now.max(f64::MIN_POSITIVE);
            for ((weight, off), (_, deviation_mm)) in weights.iter_mut().zip(offs).zip(&about) {
                *weight = (1.0 + (off / wide).powi(2)).recip() / deviation_mm.powi(2);
            }
            local = descend::<Distance>(local, samples, &weights, self.steps, TRIAL_ENDED)?;
        }
        Some((before, local))
    }
}

/// Follows a start to its end.
fn settled(mut local: Local, samples: &[Sample]) -> Option<Local> {
    let mut before = Vec::new();
    for _ in 0..ROUNDS {
        let held = held(&local, samples);
        if held == before {
            break;
        }
        local = descend::<Off>(local, samples, &held, STEPS, ENDED)?;
        before = held;
    }
    Some(local)
}

/// The samples that are not too far off, as weights.
fn held(local: &Local, samples: &[Sample]) -> Vec<f64> {
    robust::held(local.offs(samples))
}

/// A fit that has ended, with all there is to say of it.
fn told(local: Local, samples: &[Sample], area: f64) -> Option<Fit> {
    let extent_mm = extent_mm(samples);
    let shape = local.shape().filter(|shape| is_sound(shape, extent_mm))?;
    let (local, shape) = if is_seen(&shape, samples) {
        (local, shape)
    } else {
        let turned = local.turned();
        (turned, turned.shape()?)
    };
    let held = held(&local, samples);
    let (mut squares, mut squares_mm2, mut count) = (0.0, 0.0, 0_usize);
    let distances = local.distances();
    for (sample, _) in samples.iter().zip(&held).filter(|(_, held)| **held > 0.0) {
        squares += distances.off(sample).powi(2);
        squares_mm2 += distances.distance(&sample.point_mm).powi(2);
        count += 1;
    }
    let left = count.checked_sub(local.free()).filter(|left| *left > 0)? as f64;
    let Equations { matrix, .. } = Equations::at::<Off>(&local, samples, &held);
    let covariance = matrix.cholesky()?.inverse() * (squares / left * area.max(1.0));
    Some(Fit {
        shape,
        rms_mm: (squares_mm2 / count as f64).sqrt(),
        held: count,
        numbers: numbers(&local, &covariance)?,
        deviation: (squares / left).sqrt(),
        joint: joint(&local, &covariance)?,
        local,
    })
}

/// Whether a shape's normals point upwards where samples lie, for the most part: to the side that was
/// seen. What a descent comes to does not depend on it, and of a steep ring where it begins, neither.
fn is_seen(shape: &Shape, samples: &[Sample]) -> bool {
    let up = samples
        .iter()
        .map(|sample| shape.normal(&sample.point_mm).z);
    let seen = up.filter(|up| *up > 0.0).count();
    2 * seen >= samples.len()
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

/// The standard deviation of the distances, in those of the samples, by their median.
fn scale(local: &Local, samples: &[Sample]) -> f64 {
    robust::deviation(local.offs(samples))
}
