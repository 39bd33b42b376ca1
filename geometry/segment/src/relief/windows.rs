//! Planes over square windows around every node, of several sizes.

use crate::grid::Grid;

/// A plane fitted to a window.
#[derive(Debug, Clone, Copy)]
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

/// Sums over a line of nodes: count, v, v v, z, v z, z z.
type Line = [f64; 6];

/// The planes of all windows that reach so many nodes to each side and are at least half full.
///
/// Windows are summed up along rows first, then along columns, which costs by their side, not
/// by their area.
pub(crate) fn planes(grid: &Grid<'_>, reach: usize) -> Vec<WindowPlane> {
    let (columns, rows) = (grid.columns, grid.rows);
    let mut planes = Vec::with_capacity(grid.nodes());
    let mut lines: Vec<Line> = vec![[0.0; 6]; grid.nodes()];
    let reference = reference(grid);
    let mut z = vec![0.0; rows];
    for column in 0..columns {
        for (slot, z) in z.iter_mut().zip(&grid.z_mm[column * rows..]) {
            *slot = z - reference;
        }
        for row in 0..rows {
            let line = &mut lines[column * rows + row];
            let from = row.saturating_sub(reach);
            let to = (row + reach + 1).min(rows);
            for (k, &z) in z[from..to].iter().enumerate() {
                if !z.is_nan() {
                    let v = (from + k) as f64 - row as f64;
                    for (sum, term) in line.iter_mut().zip([1.0, v, v * v, z, v * z, z * z]) {
                        *sum += term;
                    }
                }
            }
        }
    }
    let least = (((2 * reach + 1) * (2 * reach + 1)) / 2) as f64;
    for column in 0..columns {
        let from = column.saturating_sub(reach);
        let to = (column + reach + 1).min(columns);
        for row in 0..rows {
            if !grid.is_valid(column * rows + row) {
                planes.push(WindowPlane::NONE);
                continue;
            }
            let mut total = [0.0; 6];
            let (mut u1, mut uu, mut uv, mut uz) = (0.0, 0.0, 0.0, 0.0);
            for c in from..to {
                let u = c as f64 - column as f64;
                let line = &lines[c * rows + row];
                for (sum, term) in total.iter_mut().zip(line) {
                    *sum += term;
                }
                u1 += u * line[0];
                uu += u * u * line[0];
                uv += u * line[1];
                uz += u * line[3];
            }
            let [n, v1, vv, z1, vz, zz] = total;
            planes.push(if n >= least {
                plane(n, [u1, v1], [uu, uv, vv], [z1, uz, vz, zz])
            } else {
                WindowPlane::NONE
            });
        }
    }
    planes
}

fn plane(
    n: f64,
    [u, v]: [f64; 2],
    [uu, uv, vv]: [f64; 3],
    [z, uz, vz, zz]: [f64; 4],
) -> WindowPlane {
    let (uu, uv, vv) = (uu - u * u / n, uv - u * v / n, vv - v * v / n);
    let (uz, vz, zz) = (uz - u * z / n, vz - v * z / n, zz - z * z / n);
    let determinant = uu * vv - uv * uv;
    if n < 4.0 || determinant < 1e-6 {
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

/// Some z of the image, so that squares of z stay small.
fn reference(grid: &Grid<'_>) -> f64 {
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
