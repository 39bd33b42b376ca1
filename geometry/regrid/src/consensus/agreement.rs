//! Samples that agree with planes, side by side.

use pulp::{Arch, Simd, WithSimd};

use crate::neighbours::Neighbour;
use crate::plane::{Plane, PlaneSums};

/// Samples summed side by side, whatever the lanes: sums are the same on every processor.
const LANES: usize = 8;
/// Samples after which it is asked, each time, whether a plane can still be good enough.
const ROUND: usize = 16;
/// What is left of the weights is told so much too high that no rounding makes it too low.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Samples, nearest first, one array for each of their numbers, filled up to whole lanes with some that
/// agree with no plane.
#[derive(Debug, Default)]
pub(super) struct Samples {
    dx: Vec<f64>,
    dy: Vec<f64>,
    z: Vec<f64>,
    weight: Vec<f64>,
    /// Sum of the weights after each round.
    left: Vec<f64>,
}

/// How well samples agree with a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Score {
    /// Sum of the weights of those that do, the less the farther they are from it.
    pub(super) evidence: f64,
    /// How many do.
    pub(super) inliers: f64,
}

impl Samples {
    /// Takes these, farther ones at less weight.
    pub(super) fn load(&mut self, samples: &[Neighbour], radius2: f64) {
        let Self {
            dx,
            dy,
            z,
            weight,
            left,
        } = self;
        for values in [&mut *dx, &mut *dy, &mut *z, &mut *weight, &mut *left] {
            values.clear();
        }
        dx.extend(samples.iter().map(|n| n.dx));
        dy.extend(samples.iter().map(|n| n.dy));
        z.extend(samples.iter().map(|n| n.z));
        let fall = 0.8 / radius2.max(f64::MIN_POSITIVE);
        weight.extend(samples.iter().map(|n| 1.0 - fall * n.distance2));
        let whole = samples.len().next_multiple_of(LANES);
        dx.resize(whole, 0.0);
        dy.resize(whole, 0.0);
        z.resize(whole, f64::INFINITY);
        weight.resize(whole, 0.0);
        let rounds = weight.chunks(ROUND).rev();
        let mut sum = 0.0;
        left.extend(rounds.map(|round| {
            let before = sum;
            sum += round.iter().sum::<f64>();
            before * ROUNDING
        }));
        left.reverse();
    }

    /// How well they agree with a plane within a width; `None` where the evidence is no more than
    /// this.
    pub(super) fn score(&self, plane: &Plane, width_mm: f64, beyond: f64) -> Option<Score> {
        Arch::new().dispatch(Scored {
            samples: self,
            plane,
            width_mm,
            beyond,
        })
    }

    /// The weighted least-squares plane of those that agree with a plane within a width.
    pub(super) fn refined(&self, plane: &Plane, width_mm: f64) -> Option<Plane> {
        let sums = Arch::new().dispatch(Refined {
            samples: self,
            plane,
            width_mm,
        });
        let change = PlaneSums::from(sums.map(|lanes| total(&lanes))).plane()?;
        Some(Plane {
            a: plane.a + change.a,
            b: plane.b + change.b,
            c: plane.c + change.c,
        })
    }

    /// The numbers of so many lanes, one after the other.
    #[inline(always)]
    fn lanes<S: Simd>(&self) -> impl Iterator<Item = [S::f64s; 4]> + '_ {
        let [dx, dy, z, weight] = [&self.dx, &self.dy, &self.z, &self.weight]
            .map(|values| S::as_simd_f64s(values).0.iter());
        dx.zip(dy)
            .zip(z.zip(weight))
            .map(|((dx, dy), (z, weight))| [*dx, *dy, *z, *weight])
    }
}

fn total([a, b, c, d, e, f, g, h]: &[f64; LANES]) -> f64 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// A plane in all lanes.
#[derive(Clone, Copy)]
struct Splat<S: Simd>([S::f64s; 3]);

impl<S: Simd> Splat<S> {
    #[inline(always)]
    fn of(simd: S, plane: &Plane) -> Self {
        Self([plane.a, plane.b, plane.c].map(|value| simd.splat_f64s(value)))
    }

    #[inline(always)]
    fn residual(&self, simd: S, [dx, dy, z, _]: [S::f64s; 4]) -> S::f64s {
        let [a, b, c] = self.0;
        let slope = simd.add_f64s(simd.mul_f64s(a, dx), simd.mul_f64s(b, dy));
        simd.sub_f64s(z, simd.add_f64s(slope, c))
    }
}

/// Puts what some lanes have, of the ones of this turn, into all.
#[inline(always)]
fn put<S: Simd>(all: &mut [f64; LANES], turn: usize, lanes: S::f64s) {
    if let Some(own) = S::as_mut_simd_f64s(all).0.get_mut(turn) {
        *own = lanes;
    }
}

struct Scored<'a> {
    samples: &'a Samples,
    plane: &'a Plane,
    width_mm: f64,
    beyond: f64,
}

impl WithSimd for Scored<'_> {
    type Output = Option<Score>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Score> {
        // As many registers as have all lanes.
        const MOST_TURNS: usize = LANES;
        let turns = LANES / S::F64_LANES;
        let plane = Splat::of(simd, self.plane);
        let [zero, one] = [0.0, 1.0].map(|value| simd.splat_f64s(value));
        let narrow = simd.splat_f64s(1.0 / (self.width_mm * self.width_mm));
        let (mut evidence, mut inliers) = ([zero; MOST_TURNS], [zero; MOST_TURNS]);
        let told = |sums: &[S::f64s; MOST_TURNS]| {
            let mut all = [0.0; LANES];
            for (turn, lanes) in sums.iter().enumerate().take(turns) {
                put::<S>(&mut all, turn, *lanes);
            }
            total(&all)
        };
        let mut rounds = self.samples.left.iter();
        let mut turn = 0;
        let mut until = ROUND / S::F64_LANES;
        for own in self.samples.lanes::<S>() {
            let residual = plane.residual(simd, own);
            let square = simd.mul_f64s(simd.mul_f64s(narrow, residual), residual);
            let share = simd.max_f64s(simd.sub_f64s(one, square), zero);
            evidence[turn] = simd.add_f64s(evidence[turn], simd.mul_f64s(own[3], share));
            let agrees = simd.greater_than_f64s(share, zero);
            let counted = simd.select_f64s(agrees, one, zero);
            inliers[turn] = simd.add_f64s(inliers[turn], counted);
            turn = (turn + 1) % turns;
            until -= 1;
            if until == 0 {
                until = ROUND / S::F64_LANES;
                let left = rounds.next().copied().unwrap_or(0.0);
                if told(&evidence) * ROUNDING + left <= self.beyond {
                    return None;
                }
            }
        }
        let score = Score {
            evidence: told(&evidence),
            inliers: told(&inliers),
        };
        (score.evidence > self.beyond).then_some(score)
    }
}

struct Refined<'a> {
    samples: &'a Samples,
    plane: &'a Plane,
    width_mm: f64,
}

/// Sums of a plane: see [`PlaneSums`].
const SUMS: usize = 9;

impl WithSimd for Refined<'_> {
    type Output = [[f64; LANES]; SUMS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let turns = LANES / S::F64_LANES;
        let plane = Splat::of(simd, self.plane);
        let zero = simd.splat_f64s(0.0);
        let width = simd.splat_f64s(self.width_mm);
        let mut found = [[0.0; LANES]; SUMS];
        // Narrower lanes go through the samples several times.
        for turn in 0..turns {
            let mut sums = [zero; SUMS];
            for own in self.samples.lanes::<S>().skip(turn).step_by(turns) {
                let [dx, dy, _, weight] = own;
                let residual = plane.residual(simd, own);
                let agrees = simd.less_than_f64s(simd.abs_f64s(residual), width);
                let weight = simd.select_f64s(agrees, weight, zero);
                // Infinite of those that fill the lanes.
                let residual = simd.select_f64s(agrees, residual, zero);
                let [wx, wy] = [dx, dy].map(|value| simd.mul_f64s(weight, value));
                let terms = [
                    weight,
                    wx,
                    wy,
                    simd.mul_f64s(wx, dx),
                    simd.mul_f64s(wx, dy),
                    simd.mul_f64s(wy, dy),
                    simd.mul_f64s(weight, residual),
                    simd.mul_f64s(wx, residual),
                    simd.mul_f64s(wy, residual),
                ];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum = simd.add_f64s(*sum, term);
                }
            }
            for (all, lanes) in found.iter_mut().zip(sums) {
                put::<S>(all, turn, lanes);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(number: u32) -> Vec<Neighbour> {
        let part = |k: u32, step: f64| libm::fmod(step * f64::from(k + 1), 1.0);
        let mut samples: Vec<Neighbour> = (0..number)
            .map(|k| {
                let (dx, dy) = (4.0 * part(k, 0.618) - 2.0, 4.0 * part(k, 0.377) - 2.0);
                let noise = 0.2 * part(k, 0.733) - 0.1;
                let outlier = if k % 5 == 0 {
                    3.0 * part(k, 0.291)
                } else {
                    0.0
                };
                Neighbour::at(dx, dy, 1.0 + 0.3 * dx - 0.1 * dy + noise + outlier)
            })
            .collect();
        samples.sort_by(Neighbour::order);
        samples
    }

    const PLANE: Plane = Plane {
        a: 0.28,
        b: -0.12,
        c: 1.02,
    };

    #[test]
    fn scores_and_sums_are_those_of_samples_one_by_one_on_all_lanes() {
        for number in [6, 8, 15, 16, 17, 40, 49, 100] {
            let window = window(number);
            let radius2 = window.last().unwrap().distance2;
            let mut samples = Samples::default();
            samples.load(&window, radius2);
            let width_mm = 0.12;
            let (mut evidence, mut inliers) = (0.0, 0.0);
            let mut sums = PlaneSums::default();
            for n in &window {
                let weight = 1.0 - 0.8 / radius2 * n.distance2;
                let residual = PLANE.residual(n);
                let share = 1.0 - residual * residual / (width_mm * width_mm);
                if share > 0.0 {
                    evidence += weight * share;
                    inliers += 1.0;
                    sums.add(n.dx, n.dy, residual, weight);
                }
            }
            let score = samples.score(&PLANE, width_mm, 0.0).unwrap();
            assert_eq!(score.inliers, inliers);
            assert!((score.evidence - evidence).abs() < 1e-12);
            let plain = Scored {
                samples: &samples,
                plane: &PLANE,
                width_mm,
                beyond: 0.0,
            };
            assert_eq!(plain.with_simd(pulp::Scalar::new()), Some(score));
            // It is given up exactly where it is no more than what is asked for.
            let just_less = score.evidence * (1.0 - 1e-12);
            assert_eq!(samples.score(&PLANE, width_mm, just_less), Some(score));
            assert_eq!(samples.score(&PLANE, width_mm, score.evidence), None);
            let refined = samples.refined(&PLANE, width_mm).unwrap();
            let change = sums.plane().unwrap();
            assert!((refined.a - PLANE.a - change.a).abs() < 1e-9);
            assert!((refined.b - PLANE.b - change.b).abs() < 1e-9);
            assert!((refined.c - PLANE.c - change.c).abs() < 1e-9);
            let refinement = || Refined {
                samples: &samples,
                plane: &PLANE,
                width_mm,
            };
            let wide = Arch::new().dispatch(refinement());
            assert_eq!(wide, refinement().with_simd(pulp::Scalar::new()));
        }
    }
}
