//! What many curves cost, side by side.

use core::iter::zip;

use pulp::{Arch, Simd, WithSimd};

#[cfg(test)]
use super::posterior::at;
use super::posterior::{Curve, Witness};

/// Witnesses as the share of curves around one, in a cell of those tried, that have each on
/// the wrong side: about `p + q (offset + slope along + bend along^2)`, cut to 0 and 1.
#[derive(Debug, Default)]
pub(super) struct AtIssue {
    p: Vec<f64>,
    q: Vec<f64>,
    along: Vec<f64>,
    trust: Vec<f64>,
    curves: Curves,
}

/// Curves in the order of their costs, and as many more as fill the last lanes.
#[derive(Debug, Default)]
struct Curves {
    offset: Vec<f64>,
    slope: Vec<f64>,
    bend: Vec<f64>,
}

/// Sums kept of each curve: one for every so many witnesses.
const SUMS: usize = 4;
/// Curves are looked at in multiples of so many, whatever the lanes.
const MOST_LANES: usize = 8;
/// Rounds of so many witnesses until it is asked whether any curve is still likely.
const ROUNDS: usize = 4;

impl AtIssue {
    pub(super) fn clear(&mut self) {
        for values in [&mut self.p, &mut self.q, &mut self.along, &mut self.trust] {
            values.clear();
        }
    }

    /// `cell` is how far the edge is moved at this place by half a cell.
    pub(super) fn push(&mut self, w: &Witness, cell: f64) {
        debug_assert!(w.trust >= 0.0, "costs only grow from witness to witness");
        let scale = 0.5 * w.side / cell;
        self.p.push(0.5 - scale * w.across);
        self.q.push(scale);
        self.along.push(w.along);
        self.trust.push(w.trust);
    }

    /// What the witnesses have against the curves around each of these; infinite where it is more
    /// than the least by more than a limit.
    pub(super) fn costs(
        &mut self,
        curves: impl Iterator<Item = Curve>,
        limit: f64,
        costs: &mut Vec<f64>,
    ) {
        let Curves {
            offset,
            slope,
            bend,
        } = &mut self.curves;
        for values in [&mut *offset, &mut *slope, &mut *bend] {
            values.clear();
        }
        for curve in curves {
            offset.push(curve[0]);
            slope.push(curve[1]);
            bend.push(curve[2]);
        }
        let number = offset.len();
        for values in [offset, slope, bend] {
            let last = values.last().copied().unwrap_or(0.0);
            values.resize(number.next_multiple_of(MOST_LANES), last);
        }
        costs.clear();
        costs.resize(number.next_multiple_of(MOST_LANES), f64::INFINITY);
        Arch::new().dispatch(Costs {
            of: self,
            limit,
            costs,
        });
        costs.truncate(number);
    }

    /// Against one curve, plainly.
    #[cfg(test)]
    fn cost(&self, curve: &Curve) -> f64 {
        let mut sums = [0.0; SUMS];
        let whole = self.p.len() / SUMS * SUMS;
        for k in 0..self.p.len() {
            let share = self.p[k] + self.q[k] * at(curve, self.along[k]);
            let sum = if k < whole { k % SUMS } else { 0 };
            sums[sum] += self.trust[k] * share.clamp(0.0, 1.0);
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }
}

struct Costs<'a> {
    of: &'a AtIssue,
    limit: f64,
    costs: &'a mut [f64],
}

impl WithSimd for Costs<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { of, limit, costs } = self;
        let (offset, _) = S::as_simd_f64s(&of.curves.offset);
        let (slope, _) = S::as_simd_f64s(&of.curves.slope);
        let (bend, _) = S::as_simd_f64s(&of.curves.bend);
        let (costs, _) = S::as_mut_simd_f64s(costs);
        let mut least = f64::INFINITY;
        // The curve in the middle is among the likeliest mostly: others are given up sooner after it.
        let middle = offset.len() / 2;
        let order = core::iter::once(middle).chain((0..offset.len()).filter(|k| *k != middle));
        for k in order {
            let curves = [offset.get(k), slope.get(k), bend.get(k)];
            if let ([Some(offset), Some(slope), Some(bend)], Some(cost)) =
                (curves, costs.get_mut(k))
                && let Some(found) = cost_of(simd, of, [*offset, *slope, *bend], least + limit)
            {
                *cost = found;
                least = least.min(simd.reduce_min_f64s(found));
            }
        }
    }
}

/// The costs of some curves; `None` where each of them is known to be more than the most.
#[inline(always)]
fn cost_of<S: Simd>(
    simd: S,
    of: &AtIssue,
    [offset, slope, bend]: [S::f64s; 3],
    most: f64,
) -> Option<S::f64s> {
    let zero = simd.splat_f64s(0.0);
    let one = simd.splat_f64s(1.0);
    let mut sums = [zero; SUMS];
    let (p, p_left) = of.p.as_chunks::<SUMS>();
    let (q, q_left) = of.q.as_chunks::<SUMS>();
    let (along, along_left) = of.along.as_chunks::<SUMS>();
    let (trust, trust_left) = of.trust.as_chunks::<SUMS>();
    // One witness: plain products and sums, so that they are the same on every processor.
    let term = |p: f64, q: f64, along: f64, trust: f64| {
        let along = simd.splat_f64s(along);
        let bent = simd.add_f64s(slope, simd.mul_f64s(along, bend));
        let at = simd.add_f64s(offset, simd.mul_f64s(along, bent));
        let share = simd.add_f64s(simd.splat_f64s(p), simd.mul_f64s(simd.splat_f64s(q), at));
        let share = simd.min_f64s(simd.max_f64s(share, zero), one);
        simd.mul_f64s(simd.splat_f64s(trust), share)
    };
    let all = |sums: &[S::f64s; SUMS]| {
        simd.add_f64s(
            simd.add_f64s(sums[0], sums[1]),
            simd.add_f64s(sums[2], sums[3]),
        )
    };
    for (round, (((p, q), along), trust)) in zip(zip(zip(p, q), along), trust).enumerate() {
        for k in 0..SUMS {
            sums[k] = simd.add_f64s(sums[k], term(p[k], q[k], along[k], trust[k]));
        }
        if round % ROUNDS == ROUNDS - 1 && simd.reduce_min_f64s(all(&sums)) > most {
            return None;
        }
    }
    for (((p, q), along), trust) in zip(zip(zip(p_left, q_left), along_left), trust_left) {
        sums[0] = simd.add_f64s(sums[0], term(*p, *q, *along, *trust));
    }
    Some(all(&sums))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_that_are_likely_cost_what_each_does_alone_and_others_are_infinite_or_do() {
        for number in [0, 1, 3, 4, 7, 16, 37, 90] {
            let mut at_issue = AtIssue::default();
            for k in 0..number {
                let along = libm::fmod(0.618 * f64::from(k), 1.0) * 20.0 - 10.0;
                let witness = Witness {
                    along,
                    across: libm::fmod(0.377 * f64::from(k), 1.0) - 0.5 + 0.05 * along,
                    side: if k % 3 == 0 { -1.0 } else { 1.0 },
                    trust: f64::from(k % 5),
                };
                at_issue.push(&witness, 0.1 + 0.01 * along.abs());
            }
            let curves: Vec<Curve> = (0..405)
                .map(|k| {
                    let [a, b, c] = [k / 45, k / 5 % 9, k % 5].map(f64::from);
                    [0.2 * a - 0.8, 0.05 * b - 0.2, 0.004 * c - 0.008]
                })
                .collect();
            let plain: Vec<f64> = curves.iter().map(|curve| at_issue.cost(curve)).collect();
            let least = plain.iter().copied().fold(f64::INFINITY, f64::min);
            let mut costs = Vec::new();
            for limit in [0.0, 7.0, f64::INFINITY] {
                at_issue.costs(curves.iter().copied(), limit, &mut costs);
                assert_eq!(costs.len(), plain.len());
                for (cost, plain) in costs.iter().zip(&plain) {
                    let is_likely = *plain <= least + limit;
                    let is_given_up = *cost == f64::INFINITY && !is_likely;
                    assert!(is_given_up || cost == plain, "{cost} {plain} {least}");
                }
            }
        }
    }

    #[test]
    fn every_kind_of_lanes_finds_the_same() {
        let mut at_issue = AtIssue::default();
        for k in 0..50 {
            let along = f64::from(k - 25);
            let witness = Witness {
                along,
                across: libm::fmod(0.377 * f64::from(k), 1.0),
                side: 1.0 - 2.0 * f64::from(k % 2),
                trust: 3.0,
            };
            at_issue.push(&witness, 0.1);
        }
        let curves = (0..121).map(|k| [f64::from(k / 11) * 0.1, f64::from(k % 11) * 0.01, 0.0]);
        let mut wide = Vec::new();
        at_issue.costs(curves, f64::INFINITY, &mut wide);
        let mut plain = vec![f64::INFINITY; 128];
        Costs {
            of: &at_issue,
            limit: f64::INFINITY,
            costs: &mut plain,
        }
        .with_simd(pulp::Scalar::new());
        assert_eq!(wide, plain[..121]);
    }
}
