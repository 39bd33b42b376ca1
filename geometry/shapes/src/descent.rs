//! The way down to the least squares.

use nalgebra::{SMatrix, SVector};

use crate::fit::Sample;
use crate::jet::{Jet, MOST_FREE, Scalar};
use crate::local::{Distances, Local};

type Matrix = SMatrix<f64, MOST_FREE, MOST_FREE>;
type Step = SVector<f64, MOST_FREE>;

/// What of a sample is made small.
pub(crate) trait Residual {
    fn of<S: Scalar>(distances: &Distances<'_, S>, sample: &Sample) -> S;
}

/// How far it lies off along its ray, in its standard deviations: what counts.
pub(crate) struct Off;

/// Its distance, millimetres: sooner told, and good enough to find one's way by. Noise that moves
/// samples down a slope tilts it.
pub(crate) struct Distance;

impl Residual for Off {
    fn of<S: Scalar>(distances: &Distances<'_, S>, sample: &Sample) -> S {
        distances.off(sample)
    }
}

impl Residual for Distance {
    fn of<S: Scalar>(distances: &Distances<'_, S>, sample: &Sample) -> S {
        distances.distance(&sample.point_mm)
    }
}

/// Squared residuals of the samples, each with its weight.
fn cost<R: Residual>(local: &Local, samples: &[Sample], weights: &[f64]) -> f64 {
    let distances = local.distances::<f64>();
    let weighed = samples.iter().zip(weights);
    weighed
        .map(|(sample, weight)| weight * R::of(&distances, sample).powi(2))
        .sum()
}

/// The normal equations of the least squares at a shape; numbers that are not free stay.
pub(crate) fn normal_equations<R: Residual>(
    local: &Local,
    samples: &[Sample],
    weights: &[f64],
) -> (Matrix, Step) {
    let (mut matrix, mut right) = (Matrix::zeros(), Step::zeros());
    let free = local.free();
    let distances = local.distances::<Jet>();
    for (sample, weight) in samples
        .iter()
        .zip(weights)
        .filter(|(_, weight)| **weight > 0.0)
    {
        let residual = R::of(&distances, sample);
        for &i in free {
            right[i] -= weight * residual.by[i] * residual.value;
            for &j in free.iter().take_while(|j| **j <= i) {
                matrix[(i, j)] += weight * residual.by[i] * residual.by[j];
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
    let mut least = cost::<R>(&local, samples, weights);
    if !least.is_finite() {
        return None;
    }
    for _ in 0..steps {
        let (matrix, right) = normal_equations::<R>(&local, samples, weights);
        let mut next = None;
        while next.is_none() && damping < 1e9 {
            let mut damped = matrix;
            for k in 0..MOST_FREE {
                damped[(k, k)] *= 1.0 + damping;
            }
            let moved = damped
                .cholesky()
                .map(|factors| local.moved(&factors.solve(&right).into()))
                .map(|moved| (cost::<R>(&moved, samples, weights), moved))
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
        let has_ended = least - cost <= ended * least;
        (local, least) = (moved, cost);
        if has_ended {
            break;
        }
    }
    Some(local)
}
