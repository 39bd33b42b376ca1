//! Logistic regression: of two sets of samples, what tells best to which one belongs.

use pulp::{Arch, Simd, WithSimd};

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
/// A step that changes weights by less than this share is the last: the next, which would be the square
/// of it, is beyond what numbers hold.
const THERE: f64 = 1e-8;
/// Odds beyond which a sample's share in either sum is nothing.
const SURE: f64 = 20.0;
/// Samples summed side by side, whatever the lanes: sums are the same on every processor.
const LANES: usize = 8;

/// Weights with which the sum of a sample's features is the logarithm of the odds of the
/// first set, sought from the ones given. The last feature has to be 1.
pub(super) fn logistic<const N: usize>(
    samples: &[Labelled],
    mut weights: [f64; N],
    features: impl Fn(&Labelled) -> [f64; N],
) -> Option<[f64; N]> {
    let table = Table::of(samples, features);
    for _ in 0..STEPS {
        let mut hessian = [[0.0; N]; N];
        let mut gradient = [0.0; N];
        for k in 0..N - 1 {
            hessian[k][k] = RIDGE;
            gradient[k] = RIDGE * weights[k];
        }
        hessian[N - 1][N - 1] = CONSTANT_RIDGE;
        let sums = Arch::new().dispatch(Sums {
            of: &table,
            weights: &weights,
        });
        for k in 0..N {
            gradient[k] += sums.gradient[k].total();
            for (own, sum) in hessian[k].iter_mut().zip(&sums.hessian[k]).take(k + 1) {
                *own += sum.total();
            }
        }
        let step = solve(hessian, gradient)?;
        let mut is_there = true;
        for (weight, step) in weights.iter_mut().zip(step) {
            *weight -= step;
            is_there &= step.abs() <= THERE * weight.abs();
        }
        if is_there {
            break;
        }
    }
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

/// Features of samples and their labels, one array each, with zeros to fill the last lanes.
struct Table<const N: usize> {
    features: [Vec<f64>; N],
    labels: Vec<f64>,
}

impl<const N: usize> Table<N> {
    fn of(samples: &[Labelled], features: impl Fn(&Labelled) -> [f64; N]) -> Self {
        let number = samples.len().next_multiple_of(LANES);
        let mut own = Self {
            features: [(); N].map(|()| Vec::with_capacity(number)),
            labels: Vec::with_capacity(number),
        };
        for s in samples {
            for (column, value) in own.features.iter_mut().zip(features(s)) {
                column.push(value);
            }
            own.labels.push(s.label);
        }
        for column in own.features.iter_mut().chain([&mut own.labels]) {
            column.resize(number, 0.0);
        }
        own
    }
}

/// A sum of what each lane has.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sum([f64; LANES]);

impl Sum {
    fn total(&self) -> f64 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }
}

/// What the samples add to the first and the second derivatives of the logarithm of the likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Derivatives<const N: usize> {
    gradient: [Sum; N],
    hessian: [[Sum; N]; N],
}

struct Sums<'a, const N: usize> {
    of: &'a Table<N>,
    weights: &'a [f64; N],
}

impl<const N: usize> WithSimd for Sums<'_, N> {
    type Output = Derivatives<N>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Derivatives<N> {
        let features: [&[S::f64s]; N] =
            core::array::from_fn(|k| S::as_simd_f64s(&self.of.features[k]).0);
        let (labels, _) = S::as_simd_f64s(&self.of.labels);
        let weights: [S::f64s; N] = core::array::from_fn(|k| simd.splat_f64s(self.weights[k]));
        let zero = simd.splat_f64s(0.0);
        let one = simd.splat_f64s(1.0);
        let sure = simd.splat_f64s(SURE);
        let mut found = Derivatives {
            gradient: [Sum([0.0; LANES]); N],
            hessian: [[Sum([0.0; LANES]); N]; N],
        };
        // Narrower lanes go through the samples several times.
        let turns = LANES / S::F64_LANES;
        for turn in 0..turns {
            let mut gradient = [zero; N];
            let mut hessian = [[zero; N]; N];
            for (at, label) in labels.iter().enumerate().skip(turn).step_by(turns) {
                let own: [S::f64s; N] = core::array::from_fn(|k| features[k][at]);
                let mut value = simd.mul_f64s(weights[0], own[0]);
                for k in 1..N {
                    value = simd.add_f64s(value, simd.mul_f64s(weights[k], own[k]));
                }
                let odds = simd.mul_f64s(*label, value);
                if simd.reduce_min_f64s(odds) > SURE {
                    continue;
                }
                let wrong = simd.div_f64s(one, simd.add_f64s(one, exp(simd, odds)));
                let counts = simd.less_than_or_equal_f64s(odds, sure);
                let wrong = simd.select_f64s(counts, wrong, zero);
                let slope = simd.neg_f64s(simd.mul_f64s(*label, wrong));
                let bend = simd.mul_f64s(wrong, simd.sub_f64s(one, wrong));
                for k in 0..N {
                    gradient[k] = simd.add_f64s(gradient[k], simd.mul_f64s(slope, own[k]));
                    let bent = simd.mul_f64s(bend, own[k]);
                    for (sum, other) in hessian[k].iter_mut().zip(own).take(k + 1) {
                        *sum = simd.add_f64s(*sum, simd.mul_f64s(bent, other));
                    }
                }
            }
            let put = |sum: &mut Sum, lanes: S::f64s| {
                if let Some(own) = S::as_mut_simd_f64s(&mut sum.0).0.get_mut(turn) {
                    *own = lanes;
                }
            };
            for k in 0..N {
                put(&mut found.gradient[k], gradient[k]);
                for (all, lanes) in found.hessian[k].iter_mut().zip(hessian[k]).take(k + 1) {
                    put(all, lanes);
                }
            }
        }
        found
    }
}

/// Below this e to the power of it is nothing beside 1.
const NOTHING: f64 = -40.0;
/// It is taken of so small a share, and squared as often as two to the power of it makes up for that.
const SQUARED: u32 = 7;
/// One over the factorials of 12 to 0.
const TAYLOR: [f64; 13] = [
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// e to the power of numbers up to [`SURE`], within some 1e-14 of it; of those below [`NOTHING`]
/// as of that.
#[inline(always)]
fn exp<S: Simd>(simd: S, power: S::f64s) -> S::f64s {
    let power = simd.max_f64s(power, simd.splat_f64s(NOTHING));
    let power = simd.min_f64s(power, simd.splat_f64s(SURE));
    let share = simd.mul_f64s(power, simd.splat_f64s(1.0 / f64::from(1 << SQUARED)));
    let mut sum = simd.splat_f64s(TAYLOR[0]);
    for term in &TAYLOR[1..] {
        sum = simd.add_f64s(simd.mul_f64s(sum, share), simd.splat_f64s(*term));
    }
    for _ in 0..SQUARED {
        sum = simd.mul_f64s(sum, sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::side::tests::grid;
    use super::*;

    #[test]
    fn powers_are_those_of_the_library() {
        for k in -4500..=2000 {
            let power = f64::from(k) * 0.01;
            let own = exp(pulp::Scalar::new(), power);
            let known = libm::exp(power.max(NOTHING));
            assert!(
                (own - known).abs() <= 3e-14 * known,
                "{power} {own} {known}"
            );
        }
    }

    #[test]
    fn sums_are_the_same_for_all_lanes_and_those_of_the_definition() {
        let samples = grid(6.3, |v| 0.4 + 0.2 * v);
        let features = |s: &Labelled| [s.u, s.v, 1.0];
        let table = Table::of(&samples, features);
        for weights in [[0.0; 3], [1.0, -0.2, -0.4], [30.0, -6.0, -12.0]] {
            let sums = || Sums {
                of: &table,
                weights: &weights,
            };
            let wide = Arch::new().dispatch(sums());
            assert_eq!(wide, sums().with_simd(pulp::Scalar::new()));
            let (mut gradient, mut hessian) = ([0.0; 3], [[0.0; 3]; 3]);
            for s in &samples {
                let own = features(s);
                let value: f64 = (0..3).map(|k| weights[k] * own[k]).sum();
                let wrong = 1.0 / (1.0 + libm::exp(s.label * value));
                for k in 0..3 {
                    gradient[k] -= s.label * wrong * own[k];
                    for (sum, other) in hessian[k].iter_mut().zip(own).take(k + 1) {
                        *sum += wrong * (1.0 - wrong) * own[k] * other;
                    }
                }
            }
            // What is left out adds e to the power of -20 of each feature at most.
            let is_near = |sum: &Sum, known: f64| (sum.total() - known).abs() < 1e-5;
            for k in 0..3 {
                assert!(is_near(&wide.gradient[k], gradient[k]));
                let rows = wide.hessian[k].iter().zip(&hessian[k]);
                assert!(rows.take(k + 1).all(|(sum, known)| is_near(sum, *known)));
            }
        }
    }

    #[test]
    fn the_gradient_vanishes_where_it_ends() {
        // Sets that overlap.
        let mut samples = grid(5.0, |v| 0.3 * v);
        for s in samples.iter_mut().step_by(9) {
            s.label = -s.label;
        }
        let weights = logistic(&samples, [0.0; 3], |s| [s.u, s.v, 1.0]).unwrap();
        let mut gradient = [RIDGE * weights[0], RIDGE * weights[1], 0.0];
        for s in &samples {
            let value = weights[0] * s.u + weights[1] * s.v + weights[2];
            let wrong = 1.0 / (1.0 + libm::exp(s.label * value));
            for (own, feature) in gradient.iter_mut().zip([s.u, s.v, 1.0]) {
                *own -= s.label * wrong * feature;
            }
        }
        assert!(gradient.iter().all(|own| own.abs() < 1e-6), "{gradient:?}");
    }
}
