//! Fairing: data points moved within a bound, so that curvature varies less.
//!
//! The idea is Kjellander's (1983): points, not the surface, are moved, none farther than a
//! bound. The points minimise the sum of squared moves plus a weight times the sum of squared
//! third differences along both directions, under the bound. The weight follows from the
//! noise by Stein's estimate of the risk (1981): of those weights with nearly the least
//! expected distance from the noiseless surface the greatest, so that fairing takes away
//! noise and leaves shape. No difference reaches across a feature line, and where the points
//! would move to one side all around, by more than noise explains, the weight is lowered: shape
//! that is sharper than the rest does not keep the rest from being faired.

use range_image::{Cancelled, Monitor};

use crate::character::Features;
use crate::grid::HeightGrid;

/// Weights tried: powers of four from the first.
const FIRST_WEIGHT: f64 = 0.25;
const WEIGHTS: usize = 9;
const GREATEST_WEIGHT: f64 = 20_000.0;
/// How far above the least risk the chosen weight's may lie.
const RISK_SLACK: f64 = 1.05;
/// Rounds in which points at the bound are found.
const MOST_ROUNDS: usize = 30;
/// Steps of conjugate gradients, and the drop of the residual at which they end, while weights
/// are tried and for the last word.
const MOST_STEPS: usize = 600;
const ROUGH_DROP: f64 = 1e-3;
const DROP: f64 = 1e-6;
/// Nodes to either side over which moves are averaged, and the standard deviations of noise at
/// which their average is shape.
const AROUND: usize = 2;
const SHAPE_FACTOR: f64 = 3.0;
/// What the weight is lowered to there, each time, and how often at most.
const LOWERED: f64 = 1.0 / 16.0;
const MOST_TIMES: usize = 4;
/// Moves this near to the bound count as at it.
const AT_BOUND: f64 = 1.0 - 1e-9;

/// What fairing did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FairingReport {
    /// No point was moved farther, millimetres.
    pub bound_mm: f64,
    /// Noise that the data show, one standard deviation, millimetres.
    pub noise_mm: f64,
    /// Mean square of the third derivative along x and y before, mm^-4.
    pub variation_before: f64,
    /// The same after.
    pub variation_after: f64,
    /// Greatest move, millimetres.
    pub greatest_move_mm: f64,
    /// Root mean square of the moves, millimetres.
    pub rms_move_mm: f64,
    /// Nodes moved as far as the bound.
    pub at_bound: usize,
    /// Pairs of neighbouring nodes between which a feature line runs.
    pub feature_crossings: usize,
}

/// Third differences that are asked to be small.
struct Energy {
    rows: usize,
    /// First nodes of those along x and along y, each with its part of the weight.
    along_x: Vec<(usize, f64)>,
    along_y: Vec<(usize, f64)>,
    /// How often the weight was lowered at each node.
    lowered: Vec<usize>,
}

impl Energy {
    fn new(grid: &HeightGrid, features: &Features) -> Self {
        let (columns, rows) = (grid.columns(), grid.rows());
        let z = grid.raw_z_mm();
        let whole = |n: usize, stride: usize, breaks: &[bool]| {
            (0..4).all(|k| !z[n + k * stride].is_nan()) && (0..3).all(|k| !breaks[n + k * stride])
        };
        let (mut along_x, mut along_y) = (Vec::new(), Vec::new());
        for i in 0..columns {
            for j in 0..rows {
                let n = i * rows + j;
                if i + 3 < columns && whole(n, rows, &features.along_x) {
                    along_x.push((n, 1.0));
                }
                if j + 3 < rows && whole(n, 1, &features.along_y) {
                    along_y.push((n, 1.0));
                }
            }
        }
        Self {
            rows,
            along_x,
            along_y,
            lowered: vec![0; columns * rows],
        }
    }

    /// Lowers the weight where points move together by more than noise does; false where they
    /// nowhere do.
    fn lower(&mut self, grid: &HeightGrid, moves: &[f64], noise_mm: f64) -> bool {
        let (columns, rows) = (grid.columns(), grid.rows());
        let z = grid.raw_z_mm();
        let is_shape = |n: usize| {
            let (i, j) = (n / rows, n % rows);
            let (mut sum, mut count) = (0.0, 0.0);
            for i in i.saturating_sub(AROUND)..(i + AROUND + 1).min(columns) {
                for j in j.saturating_sub(AROUND)..(j + AROUND + 1).min(rows) {
                    if !z[i * rows + j].is_nan() {
                        sum += moves[i * rows + j];
                        count += 1.0;
                    }
                }
            }
            count > 0.0 && f64::abs(sum) > SHAPE_FACTOR * noise_mm * f64::sqrt(count)
        };
        let mut marked = vec![false; columns * rows];
        for n in (0..columns * rows).filter(|&n| is_shape(n)) {
            let (i, j) = (n / rows, n % rows);
            for i in i.saturating_sub(AROUND)..(i + AROUND + 1).min(columns) {
                for j in j.saturating_sub(AROUND)..(j + AROUND + 1).min(rows) {
                    marked[i * rows + j] = true;
                }
            }
        }
        for (lowered, _) in self.lowered.iter_mut().zip(&marked).filter(|(_, m)| **m) {
            *lowered += 1;
        }
        for (starts, stride) in [(&mut self.along_x, rows), (&mut self.along_y, 1)] {
            for (n, part) in starts.iter_mut() {
                if (0..4).any(|k| marked[*n + k * stride]) {
                    *part *= LOWERED;
                }
            }
        }
        marked.contains(&true)
    }

    fn third(z: &[f64], n: usize, stride: usize) -> f64 {
        z[n + 3 * stride] - 3.0 * z[n + 2 * stride] + 3.0 * z[n + stride] - z[n]
    }

    fn lines(&self) -> [(&[(usize, f64)], usize); 2] {
        [(&self.along_x, self.rows), (&self.along_y, 1)]
    }

    /// Trace of the smoothing operator per node with a value.
    fn kept_share(&self, weight: f64, is_data: &[bool]) -> f64 {
        let mut nodes = [0_usize; MOST_TIMES + 1];
        for (&lowered, _) in self.lowered.iter().zip(is_data).filter(|(_, is)| **is) {
            nodes[lowered.min(MOST_TIMES)] += 1;
        }
        let all = nodes.iter().sum::<usize>().max(1) as f64;
        let (mut sum, mut weight) = (0.0, weight);
        for count in nodes {
            if count > 0 {
                sum += count as f64 / all * kept_share(weight);
            }
            weight *= LOWERED;
        }
        sum
    }

    /// Mean square of the third differences.
    fn mean_square(&self, z: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (starts, stride) in self.lines() {
            for &(n, _) in starts {
                let third = Self::third(z, n, stride);
                sum += third * third;
            }
        }
        sum / (self.along_x.len() + self.along_y.len()).max(1) as f64
    }

    /// `z + weight D'D z`.
    fn apply(&self, z: &[f64], weight: f64) -> Vec<f64> {
        let mut out = z.to_vec();
        for (starts, stride) in self.lines() {
            for &(n, part) in starts {
                let third = weight * part * Self::third(z, n, stride);
                out[n + 3 * stride] += third;
                out[n + 2 * stride] -= 3.0 * third;
                out[n + stride] += 3.0 * third;
                out[n] -= third;
            }
        }
        out
    }

    fn diagonal(&self, nodes: usize, weight: f64) -> Vec<f64> {
        let mut out = vec![1.0; nodes];
        for (starts, stride) in self.lines() {
            for &(n, part) in starts {
                for (k, square) in [1.0, 9.0, 9.0, 1.0].into_iter().enumerate() {
                    out[n + k * stride] += weight * part * square;
                }
            }
        }
        out
    }

    /// Solves `(1 + weight D'D) z = data` over the nodes that are free; the others keep
    /// their z of `start`.
    fn solve(
        &self,
        data: &[f64],
        weight: f64,
        start: &[f64],
        is_free: &[bool],
        (drop, monitor): (f64, &dyn Monitor),
    ) -> Result<Vec<f64>, Cancelled> {
        let mut z = start.to_vec();
        let image = self.apply(&z, weight);
        let only_free = |n: usize, value: f64| if is_free[n] { value } else { 0.0 };
        let mut residual: Vec<f64> = (0..z.len())
            .map(|n| only_free(n, data[n] - image[n]))
            .collect();
        let diagonal = self.diagonal(z.len(), weight);
        let mut direction: Vec<f64> = residual.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
        let mut size = dot(&residual, &direction);
        let enough = size * drop * drop;
        for _ in 0..MOST_STEPS {
            if size <= enough || size <= 0.0 {
                break;
            }
            monitor.check()?;
            let image = self.apply(&direction, weight);
            let step = size / dot(&direction, &image);
            let mut next = 0.0;
            for n in 0..z.len() {
                z[n] += step * direction[n];
                residual[n] -= only_free(n, step * image[n]);
                next += residual[n] * residual[n] / diagonal[n];
            }
            let turn = next / size;
            size = next;
            for n in 0..z.len() {
                direction[n] = residual[n] / diagonal[n] + turn * direction[n];
            }
        }
        Ok(z)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// How much curvature varies, as [`FairingReport`] has it: mean square of the third derivative
/// along x and y, mm^-4, over what no feature crosses.
#[must_use]
pub fn curvature_variation(grid: &HeightGrid, features: &Features) -> f64 {
    let scale = grid.pitch_mm() * grid.pitch_mm() * grid.pitch_mm();
    Energy::new(grid, features).mean_square(grid.raw_z_mm()) / (scale * scale)
}

/// The grid with its points moved by at most `bound_mm`, and what that did.
///
/// # Errors
/// [`Cancelled`] at the monitor's wish.
pub fn fair(
    grid: &HeightGrid,
    bound_mm: f64,
    monitor: &dyn Monitor,
) -> Result<(Vec<f64>, FairingReport), Cancelled> {
    let raw = grid.raw_z_mm();
    let noise_mm = grid.noise_mm();
    let features = Features::of(grid, noise_mm);
    let mut energy = Energy::new(grid, &features);
    let is_data: Vec<bool> = raw.iter().map(|z| !z.is_nan()).collect();
    // Around 0, so that sums keep their digits; masked nodes lie in no difference.
    let mean = raw.iter().filter(|z| !z.is_nan()).sum::<f64>() / grid.valid_nodes().max(1) as f64;
    let data: Vec<f64> = raw
        .iter()
        .map(|z| if z.is_nan() { 0.0 } else { z - mean })
        .collect();
    let mut times = 0;
    let mut first = FIRST_WEIGHT;
    let (weight, start) = loop {
        let share = |fraction: f64| (times as f64 + fraction) / (MOST_TIMES + 1) as f64;
        let of_part = Part(monitor, &share);
        let (weight, z) = chosen_weight(&energy, (&data, &is_data), noise_mm, first, &of_part)?;
        first = weight;
        times += 1;
        let moves: Vec<f64> = z.iter().zip(&data).map(|(z, d)| z - d).collect();
        if times > MOST_TIMES || !energy.lower(grid, &moves, noise_mm) {
            break (weight, z);
        }
    };
    let z = bounded(&energy, &data, weight, start, bound_mm, monitor)?;
    let faired: Vec<f64> = z
        .iter()
        .zip(&data)
        .zip(raw)
        .map(|((z, d), raw)| moved(*raw, z - d, bound_mm))
        .collect();
    let moves = || {
        let moves = faired.iter().zip(raw).map(|(z, raw)| (z - raw).abs());
        moves.filter(|m| !m.is_nan())
    };
    let scale = grid.pitch_mm() * grid.pitch_mm() * grid.pitch_mm();
    let squares: f64 = moves().map(|m| m * m).sum();
    let crossings = features.along_x.iter().chain(&features.along_y);
    let report = FairingReport {
        bound_mm,
        noise_mm,
        variation_before: energy.mean_square(raw) / (scale * scale),
        variation_after: energy.mean_square(&faired) / (scale * scale),
        greatest_move_mm: moves().fold(0.0, f64::max),
        rms_move_mm: (squares / grid.valid_nodes().max(1) as f64).sqrt(),
        at_bound: moves().filter(|m| *m >= bound_mm * AT_BOUND).count(),
        feature_crossings: crossings.filter(|crosses| **crosses).count(),
    };
    Ok((faired, report))
}

/// A point moved, by no more than the bound to the last digit.
fn moved(raw_mm: f64, by_mm: f64, bound_mm: f64) -> f64 {
    let mut z_mm = raw_mm + by_mm.clamp(-bound_mm, bound_mm);
    while (z_mm - raw_mm).abs() > bound_mm {
        z_mm = if z_mm > raw_mm {
            z_mm.next_down()
        } else {
            z_mm.next_up()
        };
    }
    z_mm
}

/// Progress as a part of the whole.
struct Part<'a>(&'a dyn Monitor, &'a (dyn Fn(f64) -> f64 + Sync));

impl Monitor for Part<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }

    fn progress(&self, fraction: f64) {
        self.0.progress((self.1)(fraction));
    }
}

/// The greatest weight with nearly the least risk, and the points under it without a bound.
fn chosen_weight(
    energy: &Energy,
    (data, is_data): (&[f64], &[bool]),
    noise_mm: f64,
    first: f64,
    monitor: &dyn Monitor,
) -> Result<(f64, Vec<f64>), Cancelled> {
    let nodes = is_data.iter().filter(|is_data| **is_data).count().max(1) as f64;
    let all_free = vec![true; data.len()];
    let mut tried: Vec<(f64, f64, Vec<f64>)> = Vec::new();
    let mut start = data.to_vec();
    let mut weight = first;
    for round in 0..WEIGHTS {
        if weight > GREATEST_WEIGHT {
            break;
        }
        let z = energy.solve(data, weight, &start, &all_free, (ROUGH_DROP, monitor))?;
        monitor.progress((round + 1) as f64 / WEIGHTS as f64);
        let off: f64 = z.iter().zip(data).map(|(z, d)| (z - d) * (z - d)).sum();
        let kept = energy.kept_share(weight, is_data);
        let risk = off / nodes + (2.0 * kept - 1.0) * noise_mm * noise_mm;
        let is_past = tried
            .iter()
            .any(|(_, least, _)| risk > 2.0 * least.max(0.01 * noise_mm * noise_mm));
        start.clone_from(&z);
        tried.push((weight, risk, z));
        if is_past {
            break;
        }
        weight *= 4.0;
    }
    // What lies below a hundredth of the noise cannot be told apart.
    let floor = 0.01 * noise_mm * noise_mm;
    let least = tried
        .iter()
        .map(|t| t.1.max(floor))
        .fold(f64::INFINITY, f64::min);
    let chosen = tried
        .into_iter()
        .rev()
        .find(|(_, risk, _)| risk.max(floor) <= RISK_SLACK * least);
    Ok(chosen.map_or((FIRST_WEIGHT, data.to_vec()), |(weight, _, z)| (weight, z)))
}

/// Trace of the smoothing operator per node, far from borders: the mean over frequencies of
/// 1 / (1 + weight (4 sin^2)^3), both directions added.
fn kept_share(weight: f64) -> f64 {
    const PARTS: usize = 64;
    let powers: Vec<f64> = (0..PARTS)
        .map(|k| {
            let angle = (k as f64 + 0.5) / PARTS as f64 * core::f64::consts::FRAC_PI_2;
            let sine = 2.0 * libm::sin(angle);
            let square = sine * sine;
            square * square * square
        })
        .collect();
    let mut sum = 0.0;
    for a in &powers {
        for b in &powers {
            sum += 1.0 / (1.0 + weight * (a + b));
        }
    }
    sum / (PARTS * PARTS) as f64
}

/// The points that minimise the same under the bound: those beyond it are held at it, and let
/// go again when they would move inwards, until that changes nothing.
fn bounded(
    energy: &Energy,
    data: &[f64],
    weight: f64,
    start: Vec<f64>,
    bound_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<f64>, Cancelled> {
    let clamped = |z: &[f64]| -> Vec<f64> {
        let both = z.iter().zip(data);
        both.map(|(z, d)| d + (z - d).clamp(-bound_mm, bound_mm))
            .collect()
    };
    let mut is_free = vec![true; start.len()];
    let mut z = energy.solve(data, weight, &start, &is_free, (DROP, monitor))?;
    for _ in 0..MOST_ROUNDS {
        let held = clamped(&z);
        let image = energy.apply(&z, weight);
        let next: Vec<bool> = (0..z.len())
            .map(|n| {
                let shift = z[n] - data[n];
                if is_free[n] {
                    shift.abs() <= bound_mm
                } else {
                    // At the bound, the descent must point outwards.
                    (data[n] - image[n]) * shift < 0.0
                }
            })
            .collect();
        if next == is_free {
            return Ok(held);
        }
        is_free = next;
        z = energy.solve(data, weight, &held, &is_free, (DROP, monitor))?;
    }
    Ok(clamped(&z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;

    const SIDE: usize = 90;
    const PITCH_MM: f64 = 0.5;

    /// Normal draws from a fixed seed, of one standard deviation.
    fn noise(count: usize) -> Vec<f64> {
        let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        (0..count)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect()
    }

    fn faired(
        truth: impl Fn(f64, f64) -> f64,
        noise_mm: f64,
        bound_mm: f64,
    ) -> (Vec<f64>, Vec<f64>, Vec<f64>, FairingReport) {
        let truth: Vec<f64> = (0..SIDE * SIDE)
            .map(|n| truth((n / SIDE) as f64 * PITCH_MM, (n % SIDE) as f64 * PITCH_MM))
            .collect();
        let draws = noise(truth.len());
        let measured: Vec<f64> = truth
            .iter()
            .zip(&draws)
            .map(|(t, d)| t + noise_mm * d)
            .collect();
        let grid = HeightGrid::new(PITCH_MM, [0.0; 2], SIDE, SIDE, measured.clone()).unwrap();
        let (z, report) = fair(&grid, bound_mm, &Unmonitored).unwrap();
        (truth, measured, z, report)
    }

    fn rms(a: &[f64], b: &[f64]) -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / a.len() as f64).sqrt()
    }

    fn hills(x: f64, y: f64) -> f64 {
        4.0 * libm::sin(x * 0.16) * libm::cos(y * 0.13) + 0.05 * x
    }

    #[test]
    fn noise_goes_and_shape_stays() {
        let (truth, measured, z, report) = faired(hills, 0.05, 0.15);
        assert!((report.noise_mm - 0.05).abs() < 0.003, "{report:?}");
        assert!(
            report.variation_after * 10.0 < report.variation_before,
            "{report:?}"
        );
        let (before, after) = (rms(&measured, &truth), rms(&z, &truth));
        assert!(after < 0.35 * before, "{before} {after}");
        assert!(report.greatest_move_mm <= 0.15, "{report:?}");
    }

    #[test]
    fn no_point_moves_over_a_bound_that_binds() {
        let (truth, measured, z, report) = faired(hills, 0.05, 0.04);
        let farthest = z
            .iter()
            .zip(&measured)
            .map(|(z, m)| (z - m).abs())
            .fold(0.0, f64::max);
        assert!(farthest <= 0.04, "{farthest}");
        assert!(report.at_bound > 500, "{report:?}");
        assert!(
            report.variation_after < report.variation_before,
            "{report:?}"
        );
        assert!(rms(&z, &truth) < rms(&measured, &truth));
    }

    #[test]
    fn a_crease_stays_sharp() {
        let ridge = |x: f64, y: f64| 3.0 - (x - 22.3 + 0.3 * (y - 22.0)).abs() * 0.6;
        let (truth, measured, z, report) = faired(ridge, 0.05, 0.15);
        assert!(report.feature_crossings > 60, "{report:?}");
        // Within two nodes of the crease the points are nearer to the truth than before.
        let near: Vec<usize> = (0..truth.len())
            .filter(|n| {
                let (x, y) = ((n / SIDE) as f64 * PITCH_MM, (n % SIDE) as f64 * PITCH_MM);
                (x - 22.3 + 0.3 * (y - 22.0)).abs() < 2.0 * PITCH_MM
            })
            .collect();
        let at = |values: &[f64]| -> Vec<f64> { near.iter().map(|&n| values[n]).collect() };
        let (before, after) = (rms(&at(&measured), &at(&truth)), rms(&at(&z), &at(&truth)));
        assert!(after < before, "{before} {after}");
    }

    #[test]
    fn noiseless_points_stay_where_they_are() {
        let (truth, _, z, report) = faired(hills, 0.0, 0.5);
        assert!(rms(&z, &truth) < 1e-4, "{report:?}");
    }
}
