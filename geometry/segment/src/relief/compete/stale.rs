//! Which nodes are to be decided anew.

use crate::grid::Grid;

/// Nodes around which a piece has changed since they were decided last, or that were not decided
/// yet, by the colours of a chessboard.
pub(super) struct Stale {
    /// A bit for each node.
    words: [Vec<u64>; 2],
}

impl Stale {
    pub(super) fn all(grid: &Grid<'_>) -> Self {
        let words = vec![0; grid.nodes().div_ceil(64)];
        let mut all = Self {
            words: [words.clone(), words],
        };
        for column in 0..grid.columns {
            for row in 0..grid.rows {
                all.add(column + row, column * grid.rows + row);
            }
        }
        all
    }

    fn add(&mut self, colour: usize, node: usize) {
        self.words[colour % 2][node / 64] |= 1 << (node % 64);
    }

    /// A node and the eight around it.
    pub(super) fn add_around(&mut self, grid: &Grid<'_>, node: usize) {
        let (columns, rows) = grid.window(node, 1);
        for column in columns {
            for row in rows.clone() {
                self.add(column + row, column * grid.rows + row);
            }
        }
    }

    /// The first node from one on that is stale and of a colour; it is not stale any longer.
    pub(super) fn take(&mut self, colour: usize, from: usize) -> Option<usize> {
        let words = &mut self.words[colour];
        // None before the first one asked for.
        let mut seen = u64::MAX << (from % 64);
        for (k, word) in words.iter_mut().enumerate().skip(from / 64) {
            let found = *word & seen;
            if found != 0 {
                let bit = found.trailing_zeros();
                *word &= !(1 << bit);
                return Some(64 * k + bit as usize);
            }
            seen = u64::MAX;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_taken_in_their_order_and_once() {
        let z_mm = vec![0.0; 15 * 10];
        let grid = Grid {
            columns: 15,
            rows: 10,
            pitch_mm: 1.0,
            z_mm: &z_mm,
        };
        let mut stale = Stale::all(&grid);
        let mut taken = Vec::new();
        for colour in [0, 1] {
            let mut from = 0;
            while let Some(node) = stale.take(colour, from) {
                let (column, row) = grid.column_row(node);
                assert_eq!((column + row) % 2, colour);
                taken.push(node);
                from = node + 1;
            }
        }
        assert!(taken[..75].is_sorted() && taken[75..].is_sorted());
        taken.sort_unstable();
        assert!(taken.into_iter().eq(0..150));
        stale.add_around(&grid, 0);
        assert_eq!(
            [0, 0, 1, 1].map(|c| stale.take(c, 0)),
            [Some(0), Some(11), Some(1), Some(10)]
        );
        assert_eq!([0, 1].map(|c| stale.take(c, 0)), [None, None]);
    }
}
