//! The image as the stages below see it: flat node numbers, neighbours, and which
//! neighbouring nodes have no step between them.

use core::cmp::Ordering;

use range_image::RangeImage;
use rayon::prelude::*;

/// Nodes of an image by flat number, column by column, upwards within a column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid<'a> {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) pitch_mm: f64,
    /// NaN where masked.
    pub(crate) z_mm: &'a [f64],
}

impl<'a> Grid<'a> {
    pub(crate) fn new(image: &'a RangeImage) -> Self {
        Self {
            columns: image.columns(),
            rows: image.rows(),
            pitch_mm: image.pitch_mm(),
            z_mm: image.raw_z_mm(),
        }
    }

    pub(crate) fn nodes(&self) -> usize {
        self.z_mm.len()
    }

    pub(crate) fn is_valid(&self, node: usize) -> bool {
        !self.z_mm[node].is_nan()
    }

    pub(crate) fn column_row(&self, node: usize) -> (usize, usize) {
        (node / self.rows, node % self.rows)
    }

    /// The node this many columns and rows away, if inside the image.
    pub(crate) fn offset(&self, node: usize, columns: isize, rows: isize) -> Option<usize> {
        let (column, row) = self.column_row(node);
        let column = column
            .checked_add_signed(columns)
            .filter(|&c| c < self.columns)?;
        let row = row.checked_add_signed(rows).filter(|&r| r < self.rows)?;
        Some(column * self.rows + row)
    }

    /// Columns and rows within `reach` of a node, as half-open ranges.
    pub(crate) fn window(
        &self,
        node: usize,
        reach: usize,
    ) -> (core::ops::Range<usize>, core::ops::Range<usize>) {
        let (column, row) = self.column_row(node);
        (
            column.saturating_sub(reach)..(column + reach + 1).min(self.columns),
            row.saturating_sub(reach)..(row + reach + 1).min(self.rows),
        )
    }
}

/// Which pairs of 4-neighbours both have a value and no step between them, and which pairs,
/// cornerwise ones too, were joined since.
#[derive(Debug, Clone)]
pub(crate) struct Links {
    rows: usize,
    /// Bit 0: linked to the next row; bit 1: to the next column; bits 2 and 3: both nodes
    /// have values, but a step lies between; bits 4 and 5: joined cornerwise to the next
    /// column's next row, and to its row before.
    bits: Vec<u8>,
}

const UP: u8 = 1;
const RIGHT: u8 = 2;
const STEP_UP: u8 = 4;
const STEP_RIGHT: u8 = 8;
const RISING: u8 = 16;
const FALLING: u8 = 32;

impl Links {
    /// Links all neighbours except where z jumps by more than `step_mm`, measured square to
    /// the surface, beyond what both sides' own slopes foretell.
    pub(crate) fn new(grid: &Grid<'_>, step_mm: f64) -> Self {
        let mut bits = vec![0; grid.nodes()];
        let columns = bits.par_chunks_mut(grid.rows.max(1)).enumerate();
        columns.for_each(|(column, bits)| {
            for (row, bits) in bits.iter_mut().enumerate() {
                let node = column * grid.rows + row;
                if row + 1 < grid.rows {
                    let line = Line {
                        grid,
                        first: node,
                        stride: 1,
                        before: row,
                        after: grid.rows - row - 2,
                    };
                    *bits |= line.judge(step_mm, UP, STEP_UP);
                }
                if column + 1 < grid.columns {
                    let line = Line {
                        grid,
                        first: node,
                        stride: grid.rows,
                        before: column,
                        after: grid.columns - column - 2,
                    };
                    *bits |= line.judge(step_mm, RIGHT, STEP_RIGHT);
                }
            }
        });
        Self {
            rows: grid.rows,
            bits,
        }
    }

    /// Links two of 8 neighbours, whatever lies between.
    pub(crate) fn join(&mut self, node: usize, other: usize) {
        let (first, second) = (node.min(other), node.max(other));
        let row = |node: usize| node % self.rows;
        let (link, step) = if first / self.rows == second / self.rows {
            (UP, STEP_UP)
        } else {
            match row(second).cmp(&row(first)) {
                Ordering::Less => (FALLING, 0),
                Ordering::Equal => (RIGHT, STEP_RIGHT),
                Ordering::Greater => (RISING, 0),
            }
        };
        self.bits[first] = self.bits[first] & !step | link;
    }

    /// Whether this node is linked with the one above.
    pub(crate) fn up(&self, node: usize) -> bool {
        self.bits[node] & UP != 0
    }

    /// Whether this node is linked with the one to its right.
    pub(crate) fn right(&self, node: usize) -> bool {
        self.bits[node] & RIGHT != 0
    }

    /// Whether a step lies between this node and the one above, or to its right.
    pub(crate) fn begins_step(&self, node: usize) -> bool {
        self.bits[node] & (STEP_UP | STEP_RIGHT) != 0
    }

    /// Whether this node is linked with all four beside it.
    pub(crate) fn all_around(&self, node: usize) -> bool {
        self.beside(node).count() == 4
    }

    /// The nodes linked with this one: below, above, left, right, and cornerwise.
    pub(crate) fn linked(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        self.beside(node).chain(self.cornerwise(node))
    }

    fn beside(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let below = node.checked_sub(1).filter(|&n| self.up(n));
        let above = self.up(node).then_some(node + 1);
        let left = node.checked_sub(self.rows).filter(|&n| self.right(n));
        let right = self.right(node).then_some(node + self.rows);
        [below, above, left, right].into_iter().flatten()
    }

    fn cornerwise(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let has = |n: usize, bit: u8| self.bits[n] & bit != 0;
        let rising = has(node, RISING).then_some(node + self.rows + 1);
        let falling = has(node, FALLING).then_some(node + self.rows - 1);
        let fallen = node.checked_sub(self.rows + 1);
        let risen = (node + 1).checked_sub(self.rows);
        let fallen = fallen.filter(|&n| has(n, RISING));
        let risen = risen.filter(|&n| has(n, FALLING));
        [rising, falling, fallen, risen].into_iter().flatten()
    }
}

/// A pair of neighbours and the line of nodes through it.
struct Line<'a> {
    grid: &'a Grid<'a>,
    first: usize,
    stride: usize,
    before: usize,
    after: usize,
}

impl Line<'_> {
    fn judge(&self, step_mm: f64, link: u8, step: u8) -> u8 {
        let z = self.grid.z_mm;
        let (a, b) = (z[self.first], z[self.first + self.stride]);
        if a.is_nan() || b.is_nan() {
            return 0;
        }
        let leap = b - a;
        if leap.abs() <= step_mm {
            return link;
        }
        let value = |inside: bool, node: usize| inside.then(|| z[node]).filter(|z| !z.is_nan());
        let before =
            value(self.before > 0, self.first.wrapping_sub(self.stride)).map(|other| a - other);
        let after = value(self.after > 0, self.first + 2 * self.stride).map(|other| other - b);
        // A crease leaves the continuation of one side only, so the smaller miss decides. At
        // an outline there is one side only, and round things fall away ever faster there.
        let (miss, rise) = match (before, after) {
            (Some(p), Some(q)) => ((leap - p).abs().min((leap - q).abs()), p.abs().min(q.abs())),
            (Some(p), None) | (None, Some(p)) => {
                let quickening = if leap * p > 0.0 { p.abs() } else { 0.0 };
                (((leap - p).abs() - quickening).max(0.0), p.abs())
            }
            (None, None) => (leap.abs(), 0.0),
        };
        let slope = rise / self.grid.pitch_mm;
        if miss > step_mm * libm::sqrt(1.0 + slope * slope) {
            step
        } else {
            link
        }
    }
}
