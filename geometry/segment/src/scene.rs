//! What all stages after the clustering share: the grid, its links and the local scale.

use crate::grid::{Grid, Links};
use crate::local_fit::{ColumnSums, Sums};
use crate::noise::Noise;

/// Label of a node that belongs to no region (yet).
pub(crate) const NONE: u32 = 0;

/// Half the side of the window of local fits, pitches.
pub(crate) const FIT_REACH: usize = 6;

/// Weight of a node beside another label, where a misplaced border may have put it on the
/// wrong side: enough to hold a fit that has no other nodes, little otherwise.
const BORDER_WEIGHT: f64 = 0.05;

#[derive(Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) grid: Grid<'a>,
    pub(crate) links: Links,
    /// Measured noise of z.
    pub(crate) noise: Noise,
    /// Jump square to the surface that counts as a step.
    pub(crate) step_mm: f64,
    /// Change of direction that counts as a crease.
    pub(crate) crease_rad: f64,
}

impl Scene<'_> {
    /// Change of direction to expect from noise alone where two local fits of this reach
    /// meet: with [`FIT_REACH`], slopes at the edge of half a window are some 0.3 noises per
    /// pitch off, so by both together 0.4. It goes with the number of nodes and their spread.
    pub(crate) fn turn_noise_rad(&self, reach: usize) -> f64 {
        let scale = FIT_REACH as f64 / reach as f64;
        0.4 * scale * scale * self.noise.deviation_mm / self.grid.pitch_mm
    }

    /// Sums of the labels in the window around a node, in the order they are met, those that
    /// `wanted` lets through. Nodes no further than `margin` from another label hardly count. z is counted from the middle node's.
    pub(crate) fn sums_around(
        &self,
        labels: &[u32],
        node: usize,
        (reach, margin): (usize, usize),
        wanted: impl Fn(u32) -> bool,
        found: &mut Vec<Sums>,
    ) {
        found.clear();
        let grid = &self.grid;
        let (column, row) = grid.column_row(node);
        let (columns, rows) = grid.window(node, reach);
        let z0 = grid.z_mm[node];
        for c in columns {
            let u = c as f64 - column as f64;
            let mut current = (NONE, ColumnSums::default());
            for r in rows.clone() {
                let k = c * grid.rows + r;
                let label = labels[k];
                if label != current.0 {
                    flush(found, u, current.0, &current.1);
                    let counts = label != NONE && wanted(label);
                    current = (if counts { label } else { NONE }, ColumnSums::default());
                }
                if current.0 == NONE {
                    continue;
                }
                let weight = if self.is_inside(labels, c, r, margin) {
                    1.0
                } else {
                    BORDER_WEIGHT
                };
                let v = r as f64 - row as f64;
                current.1.add(v, grid.z_mm[k] - z0, weight);
            }
            flush(found, u, current.0, &current.1);
        }
    }

    /// Whether no node that is 1 or `margin` nodes away along a column or row has another
    /// label.
    fn is_inside(&self, labels: &[u32], column: usize, row: usize, margin: usize) -> bool {
        let (rows, columns) = (self.grid.rows, self.grid.columns);
        let node = column * rows + row;
        let same = |other: usize| labels[other] == labels[node] || labels[other] == NONE;
        let clear = |k: usize| {
            (row < k || same(node - k))
                && (row + k >= rows || same(node + k))
                && (column < k || same(node - k * rows))
                && (column + k >= columns || same(node + k * rows))
        };
        clear(1) && (margin == 1 || clear(margin))
    }
}

/// Adds a run of nodes to the sums of their label.
fn flush(found: &mut Vec<Sums>, u: f64, label: u32, column: &ColumnSums) {
    if label == NONE {
        return;
    }
    let slot = match found.iter().position(|s| s.label == label) {
        Some(slot) => slot,
        None => {
            found.push(Sums::new(label));
            found.len() - 1
        }
    };
    found[slot].add(u, column);
}
