//! Surfaces that bend within a window.

use super::surfaces::Surface;
use crate::neighbours::Neighbour;
use crate::solve::solve;

/// Fewest samples that tell how a surface bends.
const LEAST_SAMPLES: usize = 16;
/// How many times the noise's share of the sum of squares three more terms must take. In
/// normal noise, of 39 samples, one window in 170 takes as much (Fisher's F).
const SIGNIFICANT: f64 = 5.0;
/// Terms of a quadratic, of which a plane has three.
const TERMS: usize = 6;

/// How far the surface is above its plane at the node, in millimetres, where its samples, the
/// nearest `most` of those that agree, bend away from that plane: it runs through the middle
/// of a hollow's samples, and so above its ground. 0 where they do not bend.
pub(crate) fn lift_mm(surface: &Surface, samples: &[Neighbour], most: usize) -> f64 {
    let agree = || samples.iter().filter(|n| surface.holds(n)).take(most);
    let Some(farthest) = agree().last() else {
        return 0.0;
    };
    let scale = 1.0 / farthest.distance2.max(f64::MIN_POSITIVE).sqrt();
    let mut matrix = [[0.0; TERMS]; TERMS];
    let mut right = [0.0; TERMS];
    let (mut number, mut flat) = (0, 0.0);
    for n in agree() {
        let (row, off_mm) = (terms(n, scale), surface.plane.residual(n));
        for (k, value) in row.iter().enumerate() {
            right[k] += value * off_mm;
            for (entry, other) in matrix[k].iter_mut().zip(&row).take(k + 1) {
                *entry += value * other;
            }
        }
        number += 1;
        flat += off_mm * off_mm;
    }
    if number < LEAST_SAMPLES {
        return 0.0;
    }
    let Some(solution) = solve(matrix, right) else {
        return 0.0;
    };
    let taken: f64 = solution.iter().zip(&right).map(|(x, r)| x * r).sum();
    let left = (flat - taken).max(0.0) / (number - TERMS) as f64;
    if taken / 3.0 > SIGNIFICANT * left {
        solution[0]
    } else {
        0.0
    }
}

fn terms(n: &Neighbour, scale: f64) -> [f64; TERMS] {
    let (x, y) = (scale * n.dx, scale * n.dy);
    [1.0, x, y, x * x, x * y, y * y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    /// Samples a spacing apart around the node, nearest first.
    fn samples(z: impl Fn(f64, f64) -> f64) -> Vec<Neighbour> {
        let mut samples = Vec::new();
        for column in -4..=4 {
            for row in -4..=4 {
                let (x, y) = (f64::from(column) + 0.2, f64::from(row) - 0.3);
                samples.push(Neighbour::at(x, y, z(x, y)));
            }
        }
        samples.sort_by(Neighbour::order);
        samples
    }

    fn surface(c: f64) -> Surface {
        Surface {
            plane: Plane { a: 0.1, b: 0.0, c },
            width_mm: 0.5,
            inliers: 0,
            lift_mm: 0.0,
        }
    }

    #[test]
    fn the_ground_of_a_hollow_is_met() {
        let hollow = |x: f64, y: f64| 2.0 + 0.1 * x + 0.02 * (x * x + y * y);
        // The plane through the middle of the samples lies above the ground.
        let lift_mm = lift_mm(&surface(2.13), &samples(hollow), 39);
        assert!((lift_mm + 0.13).abs() < 1e-9, "{lift_mm}");
    }

    #[test]
    fn noise_bends_no_plane() {
        // 0.05 up and down, in no order to speak of.
        let noise = |x: f64, y: f64| 0.05 * libm::sin(4e4 * libm::sin(13.0 * x + 78.0 * y));
        let flat = |x: f64, y: f64| 2.0 + 0.1 * x + noise(x, y);
        assert_eq!(lift_mm(&surface(2.0), &samples(flat), 39), 0.0);
    }

    #[test]
    fn few_samples_tell_of_no_bend() {
        let hollow = |x: f64, y: f64| 2.0 + 0.1 * x + 0.1 * (x * x + y * y);
        let few = LEAST_SAMPLES - 1;
        assert_eq!(lift_mm(&surface(2.1), &samples(hollow), few), 0.0);
    }
}
