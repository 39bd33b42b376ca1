//! Planes over square windows around every node, of several sizes.

mod lanes;
mod strip;

use pulp::Arch;
use rayon::prelude::*;

use crate::grid::Grid;
use strip::Strip;

/// A plane fitted to a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WindowPlane {
    /// Rise of z per column and per row, millimetres.
    pub(crate) rise_mm: [f32; 2],
    /// Mean square of what it leaves, in squares of millimetres; infinite where the window
    /// holds too few nodes.
    pub(crate) variance_mm2: f32,
}

impl WindowPlane {
    const NONE: Self = Self {
        rise_mm: [0.0; 2],
        variance_mm2: f32::INFINITY,
    };
}

/// The planes of all windows that reach so many nodes to each side and are at least half full.
pub(crate) fn planes(grid: &Grid<'_>, reach: usize) -> Vec<WindowPlane> {
    let mut planes = vec![WindowPlane::NONE; grid.nodes()];
    if planes.is_empty() {
        return planes;
    }
    let reference_mm = reference_mm(grid);
    // Each strip sums up the columns beside it once more, so there are no more than need be.
    let width = grid.columns.div_ceil(rayon::current_num_threads());
    let strips = planes.par_chunks_mut(width * grid.rows).enumerate();
    strips.for_each(|(k, planes)| {
        let first = k * width;
        Arch::new().dispatch(Strip {
            grid,
            reach,
            reference_mm,
            columns: first..first + planes.len() / grid.rows,
            planes,
        });
    });
    planes
}

/// Some z of the image, so that squares of z stay small.
fn reference_mm(grid: &Grid<'_>) -> f64 {
    grid.z_mm
        .iter()
        .copied()
        .find(|z| !z.is_nan())
        .unwrap_or(0.0)
}

/// For every node the window it is judged by: of those that hold the node, the one whose plane
/// leaves least, with a preference for those nearer. So no window reaches over an edge where one
/// beside it does not (Nagao & Matsuyama 1979, *Edge preserving smoothing*).
pub(crate) fn best_windows(
    grid: &Grid<'_>,
    planes: &[WindowPlane],
    reach: usize,
    deviation_mm: f64,
) -> Vec<u32> {
    let least = (deviation_mm * deviation_mm) as f32;
    let score = |node: usize| planes[node].variance_mm2.max(0.5 * least);
    // A window further away must leave less by this share of the noise for each node squared.
    let price = 0.02 * least;
    // The price is a sum of squares, so the best is found along rows, then along columns.
    let mut along: Vec<(f32, u32)> = Vec::with_capacity(grid.nodes());
    for column in 0..grid.columns {
        let first = column * grid.rows;
        for row in 0..grid.rows {
            let from = row.saturating_sub(reach);
            let to = (row + reach + 1).min(grid.rows);
            let mut best = (score(first + row), (first + row) as u32);
            for other in from..to {
                let away = other.abs_diff(row) as f32;
                let cost = score(first + other) + price * away * away;
                if cost < best.0 {
                    best = (cost, (first + other) as u32);
                }
            }
            along.push(best);
        }
    }
    let mut chosen = Vec::with_capacity(grid.nodes());
    for column in 0..grid.columns {
        let from = column.saturating_sub(reach);
        let to = (column + reach + 1).min(grid.columns);
        for row in 0..grid.rows {
            let mut best = along[column * grid.rows + row];
            for other in from..to {
                let away = other.abs_diff(column) as f32;
                let (cost, window) = along[other * grid.rows + row];
                let cost = cost + price * away * away;
                if cost < best.0 {
                    best = (cost, window);
                }
            }
            chosen.push(best.1);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plane of a window as defined, its terms summed up in the same order.
    fn plane(grid: &Grid<'_>, node: usize, reach: usize) -> WindowPlane {
        let (column, row) = grid.column_row(node);
        let (columns, rows) = grid.window(node, reach);
        let reference_mm = reference_mm(grid);
        let (mut s, mut along) = ([0.0; 6], [0.0; 4]);
        for c in columns {
            let mut line = [0.0; 6];
            for r in rows.clone() {
                let z = grid.z_mm[c * grid.rows + r] - reference_mm;
                let v = r as f64 - row as f64;
                if !z.is_nan() {
                    for (sum, term) in line.iter_mut().zip([1.0, v, v * v, z, v * z, z * z]) {
                        *sum += term;
                    }
                }
            }
            let u = c as f64 - column as f64;
            for (sum, term) in s.iter_mut().zip(line) {
                *sum += term;
            }
            let terms = [u * line[0], u * u * line[0], u * line[1], u * line[3]];
            for (sum, term) in along.iter_mut().zip(terms) {
                *sum += term;
            }
        }
        let [n, v, vv, z, vz, zz] = s;
        let [u, uu, uv, uz] = along;
        let (uu, uv, vv) = (uu - u * u / n, uv - u * v / n, vv - v * v / n);
        let (uz, vz, zz) = (uz - u * z / n, vz - v * z / n, zz - z * z / n);
        let determinant = uu * vv - uv * uv;
        let side = 2 * reach + 1;
        if !grid.is_valid(node) || n < (side * side / 2) as f64 || determinant < 1e-6 {
            return WindowPlane::NONE;
        }
        let a = (uz * vv - vz * uv) / determinant;
        let b = (vz * uu - uz * uv) / determinant;
        let left = (zz - a * uz - b * vz).max(0.0);
        WindowPlane {
            rise_mm: [a as f32, b as f32],
            variance_mm2: (left / (n - 3.0)) as f32,
        }
    }

    #[test]
    fn planes_are_those_of_each_window_alone_whatever_the_threads() {
        let (columns, rows) = (37, 29);
        let z_mm: Vec<f64> = (0..columns * rows)
            .map(|k| match k * 7919 % 13 {
                0 => f64::NAN,
                stray => 0.3 * (k / rows) as f64 - 0.1 * (k % rows) as f64 + 0.01 * stray as f64,
            })
            .collect();
        let grid = Grid {
            columns,
            rows,
            pitch_mm: 0.5,
            z_mm: &z_mm,
        };
        for reach in [2, 3, 12] {
            let alone: Vec<WindowPlane> =
                (0..grid.nodes()).map(|n| plane(&grid, n, reach)).collect();
            for threads in [1, 2, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let planes = pool.build().unwrap().install(|| planes(&grid, reach));
                assert_eq!(planes, alone, "reach {reach}, {threads} threads");
            }
        }
    }
}
