//! Levels of compact support: what the dense part leaves at the points that it does not have.
//!
//! Multistep interpolation (Floater & Iske 1996): points by ever finer spreads, on each level what the
//! levels before leave, by functions that reach a few points far. Its cost grows with the number of points.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::thin::thinned;
use super::{Implicit, Sample};

/// How many times more points each level has.
const RATIO: usize = 4;
/// Reach of a function, in mean distances to the nearest other point of its level.
const REACH: f64 = 4.0;
/// Conjugate gradients end at this residual, or after so many steps.
const RESIDUAL: f64 = 1e-8;
const MOST_STEPS: usize = 200;
/// A level is left out where what it could explain is less than this, of the noise's variance.
const WORTH: f64 = 0.5;
/// The same where there is no noise, in units of the region.
const LEAST: f64 = 1e-9;

type Cell = [i32; 3];

/// One level.
#[derive(Debug, Clone)]
pub(super) struct Fine {
    reach: f64,
    cells: HashMap<Cell, Vec<(DVec3, f64)>>,
    count: usize,
}

/// Wendland's function of four continuous derivatives, and its derivative over r, both at r of reach 1.
fn wendland(r: f64) -> (f64, f64) {
    if r >= 1.0 {
        return (0.0, 0.0);
    }
    let left = 1.0 - r;
    let squared = left * left;
    let fifth = squared * squared * left;
    let value = fifth * left * (35.0 * r * r + 18.0 * r + 3.0) / 3.0;
    let slope = -fifth * 56.0 * (5.0 * r + 1.0) / 3.0;
    (value, slope)
}

fn cell_of(at: DVec3, size: f64) -> Cell {
    (at / size).floor().to_array().map(|c| c as i32)
}

fn around(cell: Cell) -> impl Iterator<Item = Cell> {
    (0..27).map(move |k| {
        [
            cell[0] + k / 9 - 1,
            cell[1] + k / 3 % 3 - 1,
            cell[2] + k % 3 - 1,
        ]
    })
}

impl Fine {
    pub(super) fn centres(&self) -> usize {
        self.count
    }

    /// Value and gradient, in units of the region.
    pub(super) fn at(&self, at: DVec3) -> (f64, DVec3) {
        let (mut value, mut gradient) = (0.0, DVec3::ZERO);
        for cell in around(cell_of(at, self.reach)) {
            for &(centre, weight) in self.cells.get(&cell).into_iter().flatten() {
                let arm = (at - centre) / self.reach;
                let squared = arm.length_squared();
                if squared < 1.0 {
                    let (own, slope) = wendland(squared.sqrt());
                    value += weight * own;
                    gradient += weight * slope / self.reach * arm;
                }
            }
        }
        (value, gradient)
    }

    /// Levels for the samples that `dense` does not have; `noise` in units of the region.
    pub(super) fn levels(
        coarse: &Implicit,
        samples: &[Sample],
        dense: &[usize],
        noise: f64,
    ) -> Vec<Self> {
        let (origin_mm, unit_mm) = (coarse.origin_mm, coarse.unit_mm);
        let places: Vec<DVec3> = samples
            .iter()
            .map(|own| (own.place_mm - origin_mm) / unit_mm)
            .collect();
        let left = |own: &Sample| -coarse.at(own.place_mm).0 / unit_mm;
        let mut residuals: Vec<f64> = samples.par_iter().map(left).collect();
        let mut levels = Vec::new();
        let mut count = dense.len();
        while count < samples.len() {
            count = (count * RATIO).min(samples.len());
            let own = if count * 2 > samples.len() {
                count = samples.len();
                (0..count).collect()
            } else {
                thinned(samples, unit_mm, count)
            };
            let squares: f64 = own.iter().map(|&k| residuals[k] * residuals[k]).sum();
            let variance = squares / own.len() as f64;
            let worth = variance - noise * noise;
            if worth <= (WORTH * noise * noise).max(LEAST * LEAST) {
                continue;
            }
            let ridge = noise * noise / worth;
            let level = Self::of(&places, &own, &residuals, ridge);
            residuals
                .par_iter_mut()
                .zip(&places)
                .for_each(|(residual, &at)| *residual -= level.at(at).0);
            levels.push(level);
        }
        levels
    }

    fn of(places: &[DVec3], own: &[usize], residuals: &[f64], ridge: f64) -> Self {
        let points: Vec<DVec3> = own.iter().map(|&k| places[k]).collect();
        let right: Vec<f64> = own.iter().map(|&k| residuals[k]).collect();
        let reach = REACH * mean_spacing(&points);
        let mut cells: HashMap<Cell, Vec<usize>> = HashMap::new();
        for (k, &at) in points.iter().enumerate() {
            cells.entry(cell_of(at, reach)).or_default().push(k);
        }
        let row = |(k, &at): (usize, &DVec3)| {
            let mut row = Vec::new();
            for cell in around(cell_of(at, reach)) {
                for &other in cells.get(&cell).into_iter().flatten() {
                    let apart = at.distance(points[other]) / reach;
                    if apart < 1.0 {
                        let more = if other == k { ridge } else { 0.0 };
                        row.push((other as u32, wendland(apart).0 + more));
                    }
                }
            }
            row
        };
        let rows: Vec<Vec<(u32, f64)>> = points.par_iter().enumerate().map(row).collect();
        let weights = conjugate_gradients(&rows, &right);
        let mut level = Self {
            reach,
            cells: HashMap::new(),
            count: points.len(),
        };
        for (&at, weight) in points.iter().zip(weights) {
            let cell = level.cells.entry(cell_of(at, reach)).or_default();
            cell.push((at, weight));
        }
        level
    }
}

/// Mean distance to the nearest other, by some of the points.
fn mean_spacing(points: &[DVec3]) -> f64 {
    let some = points.len().div_ceil(64);
    let looked: Vec<f64> = (0..points.len())
        .step_by(some)
        .map(|k| {
            let others = points.iter().enumerate().filter(|(other, _)| *other != k);
            let apart = others.map(|(_, at)| at.distance_squared(points[k]));
            apart.fold(f64::INFINITY, f64::min).sqrt()
        })
        .collect();
    looked.iter().sum::<f64>() / looked.len().max(1) as f64
}

fn conjugate_gradients(rows: &[Vec<(u32, f64)>], right: &[f64]) -> Vec<f64> {
    let product = |x: &[f64]| -> Vec<f64> {
        rows.par_iter()
            .with_min_len(256)
            .map(|row| row.iter().map(|&(k, value)| value * x[k as usize]).sum())
            .collect()
    };
    let dot = super::dense::dot;
    let mut x = vec![0.0; right.len()];
    let mut residual = right.to_vec();
    let mut direction = residual.clone();
    let mut square = dot(&residual, &residual);
    let end = square * RESIDUAL * RESIDUAL;
    for _ in 0..MOST_STEPS {
        if square <= end {
            break;
        }
        let along = product(&direction);
        let by = square / dot(&direction, &along);
        for k in 0..x.len() {
            x[k] += by * direction[k];
            residual[k] -= by * along[k];
        }
        let next = dot(&residual, &residual);
        for k in 0..x.len() {
            direction[k] = residual[k] + next / square * direction[k];
        }
        square = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_function_and_its_derivative() {
        assert_eq!(wendland(0.0).0, 1.0);
        assert_eq!(wendland(1.0), (0.0, 0.0));
        let step = 1e-6;
        for r in [0.05, 0.3, 0.6, 0.95] {
            let by_values = (wendland(r + step).0 - wendland(r - step).0) / (2.0 * step);
            // The derivative over r.
            assert!((wendland(r).1 * r - by_values).abs() < 1e-8, "{r}");
        }
    }
}
