//! The way down to the least squares.

use nalgebra::{SMatrix, SVector};

use crate::distance::{Distances, Sloped};
use crate::fit::Sample;
use crate::local::{Local, MOST_FREE};

type Matrix = SMatrix<f64, MOST_FREE, MOST_FREE>;
type Step = SVector<f64, MOST_FREE>;

/// What of a sample is made small.
pub(crate) trait Residual {
    fn of(distances: &Distances, sample: &Sample) -> Sloped;
}

/// How far it lies off along its ray, in its standard deviations: what counts.
pub(crate) struct Off;

/// Its distance, millimetres: sooner told, and good enough to find one's way by. Noise that moves
/// samples down a slope tilts it.
pub(crate) struct Distance;

impl Residual for Off {
    fn of(distances: &Distances, sample: &Sample) -> Sloped {
        distances.sloped_off(sample)
    }
}

impl Residual for Distance {
    fn of(distances: &Distances, sample: &Sample) -> Sloped {
        distances.sloped_distance(&sample.point_mm)
    }
}

/// The normal equations of the least squares at a shape; numbers that are not free stay.
pub(crate) struct Equations {
    pub(crate) matrix: Matrix,
    right: Step,
    /// Squared residuals of the samples, each with its weight.
    cost: f64,
}

impl Equations {
    pub(crate) fn at<R: Residual>(local: &Local, samples: &[Sample], weights: &[f64]) -> Self {
        let free = local.free();
        let sums = match free {
            3 => sums::<R, 3>,
            4 => sums::<R, 4>,
            5 => sums::<R, 5>,
            6 => sums::<R, 6>,
            _ => sums::<R, MOST_FREE>,
        };
        let Self {
            mut matrix,
            right,
            cost,
        } = sums(local, samples, weights);
        for i in 0..MOST_FREE {
            if i >= free {
                matrix[(i, i)] = 1.0;
            }
            for j in 0..i {
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        Self {
            matrix,
            right,
            cost,
        }
    }

    /// The step to the least, the shorter the more it is damped.
    fn step(&self, damping: f64) -> Option<Step> {
        let mut damped = self.matrix;
        for k in 0..MOST_FREE {
            damped[(k, k)] *= 1.0 + damping;
        }
        Some(damped.cholesky()?.solve(&self.right))
    }
}

/// The lower half of the equations of the first so many numbers: with their count known, sums stay
/// at hand.
fn sums<R: Residual, const FREE: usize>(
    local: &Local,
    samples: &[Sample],
    weights: &[f64],
) -> Equations {
    let (mut products, mut right, mut cost) = ([[0.0; FREE]; FREE], [0.0; FREE], 0.0);
    let distances = local.distances();
    let weighed = samples.iter().zip(weights);
    for (sample, weight) in weighed.filter(|(_, weight)| **weight > 0.0) {
        let Sloped { value, by } = R::of(&distances, sample);
        cost += weight * value * value;
        for i in 0..FREE {
            let weighed = weight * by[i];
            right[i] -= weighed * value;
            for (sum, by) in products[i].iter_mut().zip(by).take(i + 1) {
                *sum += weighed * by;
            }
        }
    }
    let mut equations = Equations {
        matrix: Matrix::zeros(),
        right: Step::zeros(),
        cost,
    };
    for (i, (row, right)) in products.iter().zip(right).enumerate() {
        equations.right[i] = right;
        for (j, sum) in row.iter().enumerate().take(i + 1) {
            equations.matrix[(i, j)] = *sum;
        }
    }
    equations
}

/// Levenberg and Marquardt's descent, until a step lessens the cost by no more than the share
/// `ended` of it. `None` where the numbers leave what is finite.
pub(crate) fn descend<R: Residual>(
    mut local: Local,
    samples: &[Sample],
    weights: &[f64],
    steps: usize,
    ended: f64,
) -> Option<Local> {
    let mut damping = 1e-3;
    let mut here = Equations::at::<R>(&local, samples, weights);
    if !here.cost.is_finite() {
        return None;
    }
    for _ in 0..steps {
        let mut next = None;
        while next.is_none() && damping < 1e9 {
            let moved = here
                .step(damping)
                .map(|step| local.moved(&step.into()))
                .map(|moved| (Equations::at::<R>(&moved, samples, weights), moved))
                .filter(|(there, _)| there.cost <= here.cost);
            match moved {
                Some(found) => {
                    damping = (damping * 0.1).max(1e-12);
                    next = Some(found);
                }
                None => damping *= 10.0,
            }
        }
        let Some((there, moved)) = next else { break };
        let has_ended = here.cost - there.cost <= ended * here.cost;
        (local, here) = (moved, there);
        if has_ended {
            break;
        }
    }
    Some(local)
}
