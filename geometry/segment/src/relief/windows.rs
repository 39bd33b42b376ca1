//! Planes over square windows around every node, of several sizes.

mod lanes;
mod strip;

use pulp::Arch;
use rayon::prelude::*;

use crate::grid::Grid;
use strip::Strip;

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
