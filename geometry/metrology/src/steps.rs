//! Parallel planes at known heights found in a scan: a step gauge, or with one height a plate.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::random::Draws;
use crate::robust::{Spread, deviation, weight};
use crate::scan::{Placed, RawSample, within};

/// Threes of samples that are tried for a plane.
const TRIALS: usize = 1000;
/// Samples that the search looks at, about.
const SOME: usize = 8_000;
/// Rounds of assigning and fitting.
const ROUNDS: usize = 12;
/// How far apart the samples of a first plane lie at most, millimetres.
const REACH_MM: f64 = 10.0;
/// A sample belongs to a height if it is off by less than this, or a quarter of a step,
/// millimetres.
const NEAR_MM: f64 = 1.0;
/// By how much less it may be off in each round, until that is reached.
const NARROWER: f64 = 0.7;
/// Share of the samples that must lie on the heights.
const AGREE: f64 = 0.25;
/// Fewest samples on a height that counts as seen.
const FEWEST_ON_STEP: usize = 50;
/// Neighbours in a column on either side that must be on the same height.
const MARGIN: usize = 2;
/// Seed of the draws.
const SEED: u64 = 0x57e9;
/// Smallest deviation that residuals are measured in, millimetres.
const LEAST_MM: f64 = 1e-9;

/// A sample on one of the heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnStep {
    /// The sample in counts.
    pub raw: RawSample,
    /// The sample in the part frame, millimetres.
    pub point_mm: Vector3<f64>,
    /// Which of the heights.
    pub step: usize,
}

/// Parallel planes in a scan.
#[derive(Debug, Clone)]
pub struct Steps {
    /// Their unit normal, towards the camera.
    pub normal: Vector3<f64>,
    /// Where the height 0 lies along it, millimetres.
    pub offset_mm: f64,
    /// The samples on them, away from their edges.
    pub samples: Vec<OnStep>,
    /// Standard deviation of the distances, millimetres.
    pub deviation_mm: f64,
}

impl Steps {
    /// How many of the heights are seen.
    #[must_use]
    pub fn seen(&self, heights: usize) -> usize {
        (0..heights)
            .filter(|&step| {
                let own = self.samples.iter().filter(|on| on.step == step);
                own.count() >= FEWEST_ON_STEP
            })
            .count()
    }
}

/// The planes at these heights in a scan, ascending towards the camera; `None` where most of what
/// is seen is something else.
#[must_use]
pub fn find(placed: &Placed, heights_mm: &[f64]) -> Option<Steps> {
    let (wide_mm, near_mm) = near(heights_mm);
    let (mut normal, mut offset_mm) = likeliest(placed, heights_mm, wide_mm)?;
    let points: Vec<_> = placed.columns.iter().flatten().collect();
    let nearest = |normal: Vector3<f64>, offset_mm: f64, point: Vector3<f64>| {
        nearest(heights_mm, normal.dot(&point) - offset_mm)
    };
    let mut deviation_mm = near_mm;
    for round in 0..ROUNDS {
        // The first plane is told by a few neighbours, and far from these it may be well off.
        let near_mm = (wide_mm * libm::pow(NARROWER, round as f64)).max(near_mm);
        let on: Vec<_> = points
            .iter()
            .filter_map(|&&(_, point)| {
                let (step, off) = nearest(normal, offset_mm, point)?;
                (off.abs() < near_mm).then_some((point, heights_mm.get(step).copied()?))
            })
            .collect();
        (normal, offset_mm, deviation_mm) = fitted(&on, normal, offset_mm)?;
    }
    let mut samples = Vec::new();
    for column in &placed.columns {
        let steps: Vec<Option<usize>> = column
            .iter()
            .map(|&(_, point)| {
                let (step, off) = nearest(normal, offset_mm, point)?;
                (off.abs() < near_mm).then_some(step)
            })
            .collect();
        for (index, &(raw, point_mm)) in column.iter().enumerate() {
            let around = steps.get(index.saturating_sub(MARGIN)..=index + MARGIN);
            if index < MARGIN {
                continue;
            }
            if let (Some(around), Some(Some(step))) = (around, steps.get(index))
                && around.iter().all(|own| *own == Some(*step))
            {
                samples.push(OnStep {
                    raw,
                    point_mm,
                    step: *step,
                });
            }
        }
    }
    let found = Steps {
        normal,
        offset_mm,
        samples,
        deviation_mm,
    };
    let agree = found.samples.len() as f64 >= AGREE * points.len() as f64;
    (agree && found.seen(heights_mm.len()) >= heights_mm.len().min(2)).then_some(found)
}

/// What a sample may be off its height, at first and in the end.
fn near(heights_mm: &[f64]) -> (f64, f64) {
    let mut sorted = heights_mm.to_vec();
    sorted.sort_by(f64::total_cmp);
    let least = sorted
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(f64::INFINITY, f64::min);
    let near_mm = (least / 4.0).min(NEAR_MM);
    let wide_mm = if least.is_finite() {
        least / 4.0
    } else {
        near_mm
    };
    (wide_mm, near_mm)
}

/// The height nearest to this, and how far off it is.
fn nearest(heights_mm: &[f64], at_mm: f64) -> Option<(usize, f64)> {
    let off = |height: f64| at_mm - height;
    heights_mm
        .iter()
        .map(|&height| off(height))
        .enumerate()
        .min_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()))
}

/// Normal and offset of the planes that most samples lie on, by the plane through three of them.
fn likeliest(placed: &Placed, heights_mm: &[f64], near_mm: f64) -> Option<(Vector3<f64>, f64)> {
    let all: Vec<Vector3<f64>> = placed.columns.iter().flatten().map(|&(_, p)| p).collect();
    let stride = (all.len() / SOME).max(1);
    let some: Vec<_> = all.iter().step_by(stride).copied().collect();
    let mut draws = Draws::new(SEED);
    let mut best: Option<(usize, Vector3<f64>, f64)> = None;
    for _ in 0..TRIALS {
        let first = *some.get(draws.below(some.len()))?;
        let mut beside = || {
            let columns = placed.columns_within(first.x - REACH_MM, first.x + REACH_MM);
            let column = columns.get(draws.below(columns.len()))?;
            let samples = within(column, first.y - REACH_MM, first.y + REACH_MM);
            Some(samples.get(draws.below(samples.len()))?.1)
        };
        let (Some(second), Some(third)) = (beside(), beside()) else {
            continue;
        };
        let across = (second - first).cross(&(third - first));
        if across.norm() < 0.2 * REACH_MM * REACH_MM {
            continue;
        }
        let unit = across.normalize();
        let normal = if unit.z >= 0.0 { unit } else { -unit };
        for height in heights_mm {
            let offset_mm = normal.dot(&first) - height;
            let agree = some
                .iter()
                .filter_map(|point| nearest(heights_mm, normal.dot(point) - offset_mm))
                .filter(|(_, off)| off.abs() < near_mm)
                .count();
            if best.is_none_or(|(most, ..)| agree > most) {
                best = Some((agree, normal, offset_mm));
            }
        }
    }
    let (agree, normal, offset_mm) = best?;
    (agree as f64 >= AGREE * some.len() as f64).then_some((normal, offset_mm))
}

/// Normal, offset and deviation by least squares with Tukey's weights, of points with the heights
/// they lie on.
fn fitted(
    on: &[(Vector3<f64>, f64)],
    normal: Vector3<f64>,
    offset_mm: f64,
) -> Option<(Vector3<f64>, f64, f64)> {
    if on.len() < FEWEST_ON_STEP {
        return None;
    }
    let off = |(point, height): &(Vector3<f64>, f64)| normal.dot(point) - offset_mm - height;
    let scale = deviation(on.iter().map(off)).max(LEAST_MM);
    let (across, along) = tangents(normal);
    let middle = on.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / on.len() as f64;
    let mut matrix = Matrix3::zeros();
    let mut right = Vector3::zeros();
    let mut spread = Spread::default();
    for sample in on {
        let residual = off(sample) / scale;
        spread.add(residual);
        let weight = weight(residual);
        let from = sample.0 - middle;
        let slope = Vector3::new(across.dot(&from), along.dot(&from), -1.0) / scale;
        matrix += slope * slope.transpose() * weight;
        right -= slope * (weight * residual);
    }
    let step = matrix.cholesky()?.solve(&right);
    let turned = (normal + across * step.x + along * step.y).normalize();
    // About the middle of the points, which the offset keeps.
    let offset_mm = turned.dot(&middle) - normal.dot(&middle) + offset_mm + step.z;
    Some((turned, offset_mm, scale))
}

/// Two unit vectors square to a normal and to each other.
pub(crate) fn tangents(normal: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let aside = if normal.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across = normal.cross(&aside).normalize();
    (across, normal.cross(&across))
}

/// Parallel planes of which nothing is known but which samples lie on which.
#[derive(Debug, Clone)]
pub struct Parallel {
    /// Their unit normal.
    pub normal: Vector3<f64>,
    /// Where each lies along it, millimetres; `None` for one with too few samples.
    pub levels_mm: Vec<Option<f64>>,
    /// Standard deviation of the samples' distances, millimetres.
    pub deviation_mm: f64,
}

/// The parallel planes through samples, by least squares with Tukey's weights: one normal, and a
/// level for each plane. `None` where the samples do not tell it.
#[must_use]
pub fn parallel(
    points_mm: &[(Vector3<f64>, usize)],
    planes: usize,
    near: Vector3<f64>,
) -> Option<Parallel> {
    let mut normal = near;
    let mut counts = vec![0_usize; planes];
    for &(_, plane) in points_mm {
        if let Some(count) = counts.get_mut(plane) {
            *count += 1;
        }
    }
    let start: Vec<f64> = (0..planes)
        .map(|plane| {
            let own = points_mm.iter().filter(|(_, of)| *of == plane);
            let mut along: Vec<f64> = own.map(|(point, _)| normal.dot(point)).collect();
            along.sort_by(f64::total_cmp);
            along.get(along.len() / 2).copied().unwrap_or_default()
        })
        .collect();
    let mut levels = start;
    let mut scale = 0.0;
    for _ in 0..ROUNDS {
        let level = |plane: usize| levels.get(plane).copied().unwrap_or_default();
        let off = |&(point, plane): &(Vector3<f64>, usize)| normal.dot(&point) - level(plane);
        scale = deviation(points_mm.iter().map(off)).max(LEAST_MM);
        // Weighted middle of each plane's samples, so that tilt and levels do not mix.
        let mut middles = vec![(Vector3::zeros(), 0.0); planes];
        for own in points_mm {
            let weight = weight(off(own) / scale);
            if let Some((sum, weights)) = middles.get_mut(own.1) {
                *sum += own.0 * weight;
                *weights += weight;
            }
        }
        let middle = |plane: usize| {
            middles
                .get(plane)
                .map_or_else(Vector3::zeros, |(sum, weights)| {
                    sum / weights.max(f64::MIN_POSITIVE)
                })
        };
        let (across, along) = tangents(normal);
        let mut matrix = Matrix2::zeros();
        let mut right = Vector2::zeros();
        for own in points_mm {
            let weight = weight(off(own) / scale);
            let from = own.0 - middle(own.1);
            let slope = Vector2::new(across.dot(&from), along.dot(&from));
            matrix += slope * slope.transpose() * weight;
            right -= slope * (weight * normal.dot(&from));
        }
        let step = matrix.cholesky()?.solve(&right);
        normal = (normal + across * step.x + along * step.y).normalize();
        levels = (0..planes)
            .map(|plane| normal.dot(&middle(plane)))
            .collect();
    }
    let levels_mm = levels
        .into_iter()
        .zip(counts)
        .map(|(level, count)| (count >= FEWEST_ON_STEP).then_some(level))
        .collect();
    Some(Parallel {
        normal,
        levels_mm,
        deviation_mm: scale,
    })
}

/// Measured less known heights against the first that is seen, millimetres.
#[must_use]
pub fn errors_mm(levels_mm: &[Option<f64>], heights_mm: &[f64]) -> Vec<Option<f64>> {
    let mut seen = levels_mm.iter().zip(heights_mm);
    let Some((first, height)) = seen.find_map(|(level, height)| Some(((*level)?, *height))) else {
        return vec![None; heights_mm.len()];
    };
    levels_mm
        .iter()
        .zip(heights_mm)
        .map(|(level, own)| Some((*level)? - first - (own - height)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_staircase_of_wrong_heights_is_measured() {
        // Treads one behind the other: a tilt of the whole looks like longer steps.
        let normal = Vector3::new(0.1, -0.2, 1.0).normalize();
        let (across, along) = tangents(normal);
        let heights = [0.0, 10.05, 19.9];
        let mut points = Vec::new();
        for (step, height) in heights.into_iter().enumerate() {
            for k in 0..400 {
                let (u, v) = (f64::from(k % 20), f64::from(k / 20));
                let stray = if k % 17 == 0 { 3.0 } else { 0.0 };
                let noise = 0.01 * libm::sin(f64::from(k) * 12.9898);
                let at = across * (u + 20.0 * step as f64) + along * v;
                points.push((at + normal * (5.0 + height + noise + stray), step));
            }
        }
        let found = parallel(&points, 3, Vector3::z()).unwrap();
        let errors = errors_mm(&found.levels_mm, &[0.0, 10.0, 20.0]);
        for (error, truth) in errors.into_iter().zip([0.0, 0.05, -0.1]) {
            assert!((error.unwrap() - truth).abs() < 0.003, "{error:?} {truth}");
        }
        assert!((found.normal - normal).norm() < 1e-3);
    }
}
