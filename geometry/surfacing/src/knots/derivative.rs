//! Knots where derivatives break (Koo & Lee, section 4.2).
//!
//! In the middle between data points the cubic through the four points before (S1) and the
//! cubic through the four after (S2, equation (4)) are compared: where derivative `k` jumps
//! by more than a threshold it is taken to break there, and Table 1 tells how many knots
//! that needs: 4 for a step, 3 for a crease, 2 and 1 for the second and third derivative.

use crate::axis::Breaks;
use crate::error::SurfaceError;
use crate::grid::HeightGrid;
use crate::knots::{Knots, longest_sections};

/// Jumps of a derivative in noise alone reach some three standard deviations; this many are
/// taken for a break.
const NOISE_FACTOR: f64 = 5.0;
/// One break shows in the tests of this many middles to either side, since their cubics
/// reach across it.
const REACH: usize = 3;

/// Jumps at which derivative 0, 1, 2, 3 are taken to break, millimetres: the parameter of S1 and
/// S2 counts data points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JumpThresholds(pub [f64; 4]);

impl Default for JumpThresholds {
    /// 2.0 and 3.0 for the second and third derivative are the paper's (section 5). It does not
    /// tell the unit of its parameter; since its cubics run through points at equal distances,
    /// we count these. It takes the first derivative for continuous and gives no thresholds
    /// below; ours of 1.0 are lower than its own, as a step and a crease are the worse breaks.
    fn default() -> Self {
        Self([1.0, 1.0, 2.0, 3.0])
    }
}

impl JumpThresholds {
    /// Says which threshold is none.
    ///
    /// # Errors
    /// [`SurfaceError::Threshold`].
    pub fn validate(&self) -> Result<(), SurfaceError> {
        for (order, &value) in self.0.iter().enumerate() {
            if value.is_nan() || value <= 0.0 {
                return Err(SurfaceError::Threshold { order, value });
            }
        }
        Ok(())
    }

    /// Raised to what noise does not reach.
    #[must_use]
    pub fn above_noise(mut self, noise_mm: f64) -> Self {
        let weights = one_sided();
        for (threshold, weights) in self.0.iter_mut().zip(weights) {
            let gain = weights.iter().map(|w| w * w).sum::<f64>() * 2.0;
            *threshold = threshold.max(NOISE_FACTOR * noise_mm * gain.sqrt());
        }
        self
    }
}

/// A derivative breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// Where, in nodes: middles lie at 0.5, 1.5, ...
    pub at: f64,
    /// The lowest derivative that breaks, 0 to 3.
    pub order: usize,
    /// By how much, millimetres (the parameter counts points).
    pub jump: f64,
}

impl Break {
    /// Number of knots that it needs (Table 1).
    #[must_use]
    pub fn multiplicity(&self) -> usize {
        4 - self.order
    }
}

/// Weights with which values at -3.5, -2.5, -1.5 and -0.5 give derivative 0 to 3 of the
/// cubic through them at 0.
pub(crate) fn one_sided() -> [[f64; 4]; 4] {
    const AT: [f64; 4] = [-3.5, -2.5, -1.5, -0.5];
    let mut weights = [[0.0; 4]; 4];
    for k in 0..4 {
        // The Lagrange polynomial of node k in powers.
        let mut powers = [1.0, 0.0, 0.0, 0.0];
        for (m, root) in AT.iter().enumerate() {
            if m == k {
                continue;
            }
            let scale = 1.0 / (AT[k] - root);
            for p in (0..4).rev() {
                let lower = if p > 0 { powers[p - 1] } else { 0.0 };
                powers[p] = (lower - powers[p] * root) * scale;
            }
        }
        for (order, factorial) in [1.0, 1.0, 2.0, 6.0].into_iter().enumerate() {
            weights[order][k] = powers[order] * factorial;
        }
    }
    weights
}

/// S1 and S2 with their derivatives at each middle: `[k][0]` before, `[k][1]` after, by
/// order, per node (not per millimetre). NaN where a point is missing.
pub(crate) fn both_sides(z: &[f64]) -> Vec<[[f64; 4]; 2]> {
    let weights = one_sided();
    let middles = z.len().saturating_sub(1);
    (0..middles)
        .map(|k| {
            // Points k - 3 ..= k lie before the middle k + 0.5, k + 1 ..= k + 4 after.
            let mut sides = [[f64::NAN; 4]; 2];
            if k < 3 || k + 4 >= z.len() {
                return sides;
            }
            for (order, weights) in weights.iter().enumerate() {
                let before = (0..4).map(|m| weights[m] * z[k - 3 + m]).sum();
                let mirrored: f64 = (0..4).map(|m| weights[m] * z[k + 4 - m]).sum();
                let after = if order % 2 == 0 { mirrored } else { -mirrored };
                sides[0][order] = before;
                sides[1][order] = after;
            }
            sides
        })
        .collect()
}

/// The breaks along a section, from its first to its last: the lowest derivative first, and
/// of neighbouring ones that jumps most, so that one break is told once.
#[must_use]
pub fn breaks_of(z_mm: &[f64], thresholds: &JumpThresholds) -> Vec<Break> {
    let jumps: Vec<[f64; 4]> = both_sides(z_mm)
        .iter()
        .map(|[before, after]| core::array::from_fn(|order| (after[order] - before[order]).abs()))
        .collect();
    let mut is_taken = vec![false; jumps.len()];
    let mut found = Vec::new();
    for order in 0..4 {
        let threshold = thresholds.0[order];
        let mut candidates: Vec<usize> = (0..jumps.len())
            .filter(|&k| jumps[k][order] >= threshold)
            .filter(|&k| is_own(&jumps[k], order))
            .collect();
        // Beside the break the cubics reach across it and can miss each other by more, but
        // there the next derivative jumps, too.
        let rank = |k: usize| {
            let next = jumps[k].get(order + 1).copied().unwrap_or(0.0);
            jumps[k][order] - 0.5 * next
        };
        candidates.sort_by(|&a, &b| rank(b).total_cmp(&rank(a)).then(a.cmp(&b)));
        for k in candidates {
            if is_taken[k] {
                continue;
            }
            let reach = k.saturating_sub(REACH)..(k + REACH + 1).min(is_taken.len());
            is_taken[reach].fill(true);
            found.push(Break {
                at: k as f64 + 0.5,
                order,
                jump: jumps[k][order],
            });
        }
    }
    found.sort_by(|a, b| a.at.total_cmp(&b.at));
    found
}

/// Whether a derivative breaks at this middle, and not a higher one beside it: a cubic of which
/// the last point lies across a break misses by 2.2, 3.0, 2.5 and 1 times that point's
/// distance in value and derivatives, so that the next derivative jumps nearly as much.
fn is_own(jumps: &[f64; 4], order: usize) -> bool {
    const LEAST: [f64; 4] = [1.0, 1.5, 3.0, 0.0];
    let next = jumps.get(order + 1).copied().unwrap_or(0.0);
    jumps[order] > LEAST[order] * next
}

/// Knots where derivatives of the reference sections break. A surface with four knots in a
/// place would fall apart there; three keep its pieces together, and the step between two
/// nodes is bridged.
pub(crate) fn place(grid: &HeightGrid, thresholds: &JumpThresholds) -> Knots {
    let (xz, yz) = longest_sections(grid);
    let knots = |z_mm: &[f64], nodes: usize| {
        let breaks = breaks_of(z_mm, thresholds);
        let inner = breaks
            .iter()
            .flat_map(|b| core::iter::repeat_n(b.at, b.multiplicity().min(3)))
            .collect();
        Breaks::new(nodes, inner).solvable()
    };
    Knots {
        u: knots(&xz.z_mm, grid.columns()),
        v: knots(&yz.z_mm, grid.rows()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubics_of_both_sides_reproduce_a_cubic() {
        let cubic = |t: f64| 2.0 - t + 0.5 * t * t - 0.03 * t * t * t;
        let z: Vec<f64> = (0..12).map(|k| cubic(f64::from(k))).collect();
        let sides = both_sides(&z);
        let t = 5.5;
        let expected = [cubic(t), -1.0 + t - 0.09 * t * t, 1.0 - 0.18 * t, -0.18];
        for side in sides[5] {
            for (value, expected) in side.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-12, "{value} {expected}");
            }
        }
        assert!(sides[2][0][0].is_nan() && sides[8][1][0].is_nan());
    }

    #[test]
    fn each_break_is_told_once_with_its_order() {
        // Powers of a truncated distance break one derivative each.
        let h = 0.5;
        for order in 0..4_usize {
            let size = [3.0, 4.0, 12.0, 60.0][order];
            let factorial = [1.0, 1.0, 2.0, 6.0][order];
            let z: Vec<f64> = (0..60)
                .map(|k| {
                    let t = f64::from(k) * h - 15.25;
                    let part = if t > 0.0 {
                        (0..order).fold(size / factorial, |p, _| p * t)
                    } else {
                        0.0
                    };
                    0.3 * t + part
                })
                .collect();
            let found = breaks_of(&z, &JumpThresholds::default());
            assert_eq!(found.len(), 1, "order {order}: {found:?}");
            assert_eq!(found[0].order, order, "{found:?}");
            assert_eq!(found[0].multiplicity(), 4 - order);
            assert!((found[0].at - 30.5).abs() <= 1.0, "{found:?}");
        }
    }

    #[test]
    fn thresholds_rise_above_noise() {
        // One in five of these would pass the paper's threshold of the third derivative.
        let noise = |k: usize| {
            let x = libm::sin((k as f64 + 1.0) * 12.9898) * 43_758.547;
            (x - libm::floor(x) - 0.5) * 0.8
        };
        let z: Vec<f64> = (0..400).map(noise).collect();
        let printed = breaks_of(&z, &JumpThresholds::default());
        assert!(printed.len() > 5, "{}", printed.len());
        let raised = JumpThresholds::default().above_noise(0.8 / 12.0_f64.sqrt());
        assert_eq!(breaks_of(&z, &raised), []);
        assert!(JumpThresholds([1.0, 0.0, 1.0, 1.0]).validate().is_err());
    }
}
