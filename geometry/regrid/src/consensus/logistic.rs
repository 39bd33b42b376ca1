//! Logistic regression: of two sets of samples, what tells best to which one belongs.

use super::side::Labelled;
use crate::solve::solve;

/// How much a steeper transition costs against samples on the wrong side: so little that
/// between sets which can be separated the widest lane is found.
const RIDGE: f64 = 1e-4;
/// The same for the constant, only to keep the system regular where all samples have one
/// label.
const CONSTANT_RIDGE: f64 = 1e-9;
/// Newton's steps; each about doubles the steepness between separable sets.
const STEPS: usize = 16;

/// Weights with which the sum of a sample's features is the logarithm of the odds of the
/// first set, sought from the ones given. The last feature has to be 1.
pub(super) fn logistic<const N: usize>(
    samples: &[Labelled],
    mut weights: [f64; N],
    features: impl Fn(&Labelled) -> [f64; N],
) -> Option<[f64; N]> {
    for _ in 0..STEPS {
        let mut hessian = [[0.0; N]; N];
        let mut gradient = [0.0; N];
        for k in 0..N - 1 {
            hessian[k][k] = RIDGE;
            gradient[k] = RIDGE * weights[k];
        }
        hessian[N - 1][N - 1] = CONSTANT_RIDGE;
        for s in samples {
            let features = features(s);
            let odds = s.label * value(&weights, &features);
            // Beyond this a sample's share in either sum is nothing.
            if odds > 20.0 {
                continue;
            }
            let wrong = 1.0 / (1.0 + libm::exp(odds));
            let slope = -s.label * wrong;
            let bend = wrong * (1.0 - wrong);
            for k in 0..N {
                gradient[k] += slope * features[k];
                for l in 0..=k {
                    hessian[k][l] += bend * features[k] * features[l];
                }
            }
        }
        let step = solve(hessian, gradient)?;
        for (weight, step) in weights.iter_mut().zip(step) {
            *weight -= step;
        }
    }
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

/// The weighted sum of features.
fn value<const N: usize>(weights: &[f64; N], features: &[f64; N]) -> f64 {
    let mut sum = weights[0] * features[0];
    for k in 1..N {
        sum += weights[k] * features[k];
    }
    sum
}
