//! On which side of a border nodes beside it lie.

use crate::grid::HeightGrid;
use crate::parted::regions::{around, square};

/// Nodes so near to another region are held against both: amid noise the segmentation takes a node or
/// two across a crease.
const DOUBTFUL_NODES: usize = 2;
/// Nodes so near, but for doubtful ones, tell how a region goes on.
const REACH_NODES: usize = 7;
/// Fewest of them.
const FEWEST: usize = 16;
/// Times that nodes may change sides.
const ROUNDS: usize = 3;
/// How much nearer a node must be to another region, in noise.
const NEARER: f64 = 1.0;

/// Gives nodes beside borders to the neighbour that, carried on as a paraboloid, comes nearest.
pub(super) fn settle(grid: &HeightGrid, labels: &mut [u16]) {
    let (columns, rows, z) = (grid.columns(), grid.rows(), grid.raw_z_mm());
    let nearer_mm = NEARER * grid.noise_mm();
    for _ in 0..ROUNDS {
        let before = labels.to_vec();
        let is_doubtful: Vec<bool> = (0..before.len())
            .map(|n| {
                let beside = square(n, DOUBTFUL_NODES, columns, rows);
                beside
                    .into_iter()
                    .any(|m| before[m] != 0 && before[m] != before[n])
            })
            .collect();
        let mut is_settled = true;
        for n in 0..before.len() {
            if before[n] == 0 || z[n].is_nan() || !is_doubtful[n] {
                continue;
            }
            let off = |label: u16| {
                let nodes = square(n, REACH_NODES, columns, rows)
                    .filter(|m| before[*m] == label && !is_doubtful[*m] && !z[*m].is_nan());
                let places = nodes.map(|m| {
                    let along = |a: usize, b: usize| a as f64 - b as f64;
                    (
                        [along(m / rows, n / rows), along(m % rows, n % rows)],
                        z[m] - z[n],
                    )
                });
                paraboloid(&places.collect::<Vec<_>>()).map(f64::abs)
            };
            let Some(own_mm) = off(before[n]) else {
                continue;
            };
            let beside = around(n, columns, rows).map(|m| before[m]);
            let others = beside.filter(|label| *label != 0 && *label != before[n]);
            let best = others
                .filter_map(|label| Some((off(label)?, label)))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some((off_mm, label)) = best
                && off_mm + nearer_mm < own_mm
            {
                labels[n] = label;
                is_settled = false;
            }
        }
        if is_settled {
            return;
        }
    }
}

/// Value at the origin of the paraboloid of least squares through places, `None` where they do not
/// hold one.
fn paraboloid(places: &[([f64; 2], f64)]) -> Option<f64> {
    const TERMS: usize = 6;
    if places.len() < FEWEST {
        return None;
    }
    // Normal equations; places are a few units off, so that they are well enough conditioned.
    let mut rows = [[0.0; TERMS + 1]; TERMS];
    for &([x, y], z) in places {
        let terms = [1.0, x, y, x * x, x * y, y * y];
        for (row, a) in rows.iter_mut().zip(terms) {
            for (sum, b) in row.iter_mut().zip(terms.iter().chain(&[z])) {
                *sum += a * b;
            }
        }
    }
    // From the last term upwards, so that the first is solved for at once.
    for k in (1..TERMS).rev() {
        let row = rows[k];
        if row[k] <= 1e-9 * places.len() as f64 {
            return None;
        }
        for other in &mut rows[..k] {
            let share = other[k] / row[k];
            for (a, b) in other.iter_mut().zip(row) {
                *a -= share * b;
            }
        }
    }
    (rows[0][0] > 1e-9).then(|| rows[0][TERMS] / rows[0][0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paraboloid_is_found_beside_its_places() {
        let z = |x: f64, y: f64| 3.0 - x + 2.0 * y + 0.5 * x * x - 0.2 * x * y + 0.1 * y * y;
        let places: Vec<_> = (0..30)
            .map(|n| [2.0 + f64::from(n / 6), f64::from(n % 6) - 3.0])
            .map(|[x, y]| ([x, y], z(x, y)))
            .collect();
        assert!((paraboloid(&places).unwrap() - 3.0).abs() < 1e-9);
        let line: Vec<_> = (0..30).map(|n| ([f64::from(n), 1.0], 0.0)).collect();
        assert_eq!(paraboloid(&line), None);
    }

    #[test]
    fn nodes_across_a_crease_go_back() {
        let ridge = |n: usize| -((n / 20) as f64 - 9.5 + 0.3 * (n % 20) as f64 - 3.0).abs();
        let z = (0..400).map(ridge).collect();
        let grid = HeightGrid::new(1.0, [0.0; 2], 20, 20, z).unwrap();
        let true_side =
            |n: usize| 1 + u16::from((n / 20) as f64 - 9.5 + 0.3 * (n % 20) as f64 - 3.0 > 0.0);
        let right: Vec<u16> = (0..400).map(true_side).collect();
        let mut labels: Vec<u16> = (0..400)
            .map(|n| match n % 20 {
                8..=10 => true_side((n + 20).min(399)),
                _ => true_side(n),
            })
            .collect();
        assert_ne!(labels, right);
        settle(&grid, &mut labels);
        assert_eq!(labels, right);
    }
}
