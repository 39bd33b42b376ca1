//! What places that are known to lie inside and outside say of an outline.
//!
//! A sample beside an edge says on which side of it its ray passed, and no more; so the outline is
//! known to lie between the last sample on one side and the first on the other, all along. All
//! outlines that do are about as likely, so that the middle of them is better than any single one
//! of them: the mean over the posterior, drawn by random walks (Metropolis et al. 1953), and its
//! spread is the uncertainty.

use super::hearing::{self, Hearing};
use super::shape::Shape;
use crate::chance::Chance;

/// A place that lies on one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Witness {
    /// The place in the plan, millimetres.
    pub place: [f64; 2],
    /// Whether it says that it is inside.
    pub inside: bool,
    /// How often such a witness is wrong, 0 to 0.5.
    pub doubt: f64,
    /// It may lie so far on the other side, millimetres.
    pub slack_mm: f64,
}

/// An outline with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// The mean.
    pub shape: Shape,
    /// Covariance of its numbers, see [`Shape::numbers`].
    pub covariance: [[f64; 6]; 6],
    /// Logarithm of the likelihood of the mean.
    pub log_likelihood: f64,
    /// Share of the witnesses beside the outline that it contradicts beyond doubt.
    pub contradicted: f64,
    /// Witnesses beside it.
    pub witnesses: usize,
}

/// Most witnesses that a walk goes by: more make an outline that is known to a few micrometres no
/// surer, and cost time.
const MOST_WITNESSES: usize = 6000;
/// The stream of draws of the walks.
const WALK: u64 = 0x0071_11e5;
/// How sharp the edge is in the end, pitches: places, rays and spots are that exact.
const SHARPNESS: f64 = 0.03;
/// Softer edges are gone through first, so that no walk begins in the wrong valley.
const SOFTENINGS: [f64; 5] = [32.0, 16.0, 8.0, 4.0, 2.0];
/// Sweeps over all numbers for each softening, to adapt the steps, and to be kept.
const SOFT_SWEEPS: usize = 40;
const SETTLING_SWEEPS: usize = 150;
const KEPT_SWEEPS: usize = 700;
/// Witnesses further from the first outline than this, pitches, always say the same.
const NEAR: f64 = 4.0;
/// And in the end than this.
const NARROW: f64 = 1.6;
/// Contradicted by more than this, pitches, a witness is not merely unsharp.
const FAR_OFF: f64 = 0.6;

/// The outline that the witnesses tell of, starting from a shape near to it. `pitch_mm` is the
/// distance of samples.
#[must_use]
pub fn outline(start: Shape, witnesses: &[Witness], pitch_mm: f64, seed: u64) -> Outline {
    let mut walk = Walk::new(start, witnesses, pitch_mm, seed);
    for softening in SOFTENINGS {
        walk.soften(softening * SHARPNESS * pitch_mm);
        for _ in 0..SOFT_SWEEPS {
            walk.sweep(true);
        }
    }
    walk.narrow();
    walk.soften(SHARPNESS * pitch_mm);
    for _ in 0..SETTLING_SWEEPS {
        walk.sweep(true);
    }
    let mut kept = Vec::with_capacity(KEPT_SWEEPS);
    for _ in 0..KEPT_SWEEPS {
        walk.sweep(false);
        kept.push(walk.shape.numbers());
    }
    let count = kept.len() as f64;
    let mut mean = [0.0; 6];
    for numbers in &kept {
        for (sum, value) in mean.iter_mut().zip(numbers) {
            *sum += value / count;
        }
    }
    let mut covariance = [[0.0; 6]; 6];
    for numbers in &kept {
        for a in 0..6 {
            for b in 0..6 {
                let both = (numbers[a] - mean[a]) * (numbers[b] - mean[b]);
                covariance[a][b] += both / (count - 1.0);
            }
        }
    }
    let shape = walk.shape.with(&mean).unwrap_or(walk.shape);
    let (far, all) = walk.contradicted(&shape);
    Outline {
        shape,
        covariance,
        log_likelihood: walk.hearing.log_likelihood(&shape),
        contradicted: far as f64 / all.max(1) as f64,
        witnesses: all,
    }
}

/// Logarithm of the likelihood of a shape, edges as sharp as they are in the end.
#[must_use]
pub fn log_likelihood(shape: &Shape, witnesses: &[Witness], pitch_mm: f64) -> f64 {
    hearing::log_likelihood(shape, witnesses, 1.0 / (SHARPNESS * pitch_mm))
}

struct Walk {
    shape: Shape,
    hearing: Hearing,
    pitch_mm: f64,
    steps: [f64; 6],
    current: f64,
    dice: Chance,
}

impl Walk {
    fn new(start: Shape, witnesses: &[Witness], pitch_mm: f64, seed: u64) -> Self {
        let near = |w: &&Witness| start.distance_mm(w.place).abs() <= NEAR * pitch_mm;
        let mut steps = [pitch_mm; 6];
        if let Shape::Rectangle(rectangle) = start {
            let [a, b] = rectangle.sizes_mm();
            steps[0] = pitch_mm / a.max(b);
        }
        let all = witnesses.iter().filter(near).copied().collect();
        let mut walk = Self {
            shape: start,
            hearing: Hearing::new(thinned(all), start, pitch_mm, pitch_mm),
            pitch_mm,
            steps,
            current: 0.0,
            dice: Chance::new(seed, WALK),
        };
        walk.current = walk.hearing.log_likelihood(&start);
        walk
    }

    /// Leaves out the witnesses that always say the same from here on.
    fn narrow(&mut self) {
        let distance_mm = self.shape.distances();
        let within = NARROW * self.pitch_mm;
        let mut all = core::mem::take(&mut self.hearing.all);
        all.retain(|witness| distance_mm(witness.place).abs() <= within);
        self.hearing.all = thinned(all);
    }

    fn soften(&mut self, sharpness_mm: f64) {
        let all = core::mem::take(&mut self.hearing.all);
        self.hearing = Hearing::new(all, self.shape, sharpness_mm, self.pitch_mm);
        self.current = self.hearing.log_likelihood(&self.shape);
    }

    fn sweep(&mut self, adapt: bool) {
        for index in 0..self.shape.freedom() {
            let mut numbers = self.shape.numbers();
            let step = self.steps[index] * (2.0 * self.dice.unit() - 1.0);
            numbers[index] += step;
            self.turn_about_middle(index, step, &mut numbers);
            if let (Shape::Rectangle(_), 5) = (self.shape, index) {
                // Corners cannot be sharper than sharp: the walk is thrown back there.
                numbers[5] = numbers[5].abs();
            }
            let chance = self.dice.unit();
            let taken = self.shape.with(&numbers).is_some_and(|shape| {
                let likelihood = self.hearing.log_likelihood(&shape);
                let taken = libm::log(chance.max(1e-300)) < likelihood - self.current;
                if taken {
                    self.shape = shape;
                    self.current = likelihood;
                    self.hearing.follow(&shape);
                }
                taken
            });
            if adapt {
                // About two steps of five are taken where steps fit.
                self.steps[index] *= if taken { 1.25 } else { 0.86 };
                self.steps[index] = self.steps[index].min(2.0 * self.pitch_mm);
            }
        }
    }

    /// Sides are measured along turned axes, from the origin: they turn about the middle with it.
    fn turn_about_middle(&self, index: usize, step: f64, numbers: &mut [f64; 6]) {
        let (Shape::Rectangle(before), 0) = (self.shape, index) else {
            return;
        };
        let middle = before.middle_mm();
        let was = before.along(middle);
        let mut turned = before;
        turned.angle_rad += step;
        let is = turned.along(middle);
        for side in 0..2 {
            numbers[1 + side] += is[0] - was[0];
            numbers[3 + side] += is[1] - was[1];
        }
    }

    fn contradicted(&self, shape: &Shape) -> (usize, usize) {
        let (mut far, mut all) = (0, 0);
        for witness in &self.hearing.all {
            let distance = shape.distance_mm(witness.place);
            if distance.abs() > NARROW * self.pitch_mm || witness.doubt > 0.1 {
                continue;
            }
            all += 1;
            let inwards = if witness.inside { -distance } else { distance };
            if inwards < -FAR_OFF * self.pitch_mm {
                far += 1;
            }
        }
        (far, all)
    }
}

/// Every so many witnesses where there are more than are needed.
fn thinned(all: Vec<Witness>) -> Vec<Witness> {
    let stride = all.len().div_ceil(MOST_WITNESSES).max(1);
    all.into_iter().step_by(stride).collect()
}
