//! What many moves leave together, found by place.

use crate::cutter::Cutter;
use crate::way::Way;

/// Cells within the cutter's radius.
const CELLS: f64 = 5.0;
/// Cells at most; coarser ones only take longer.
const MOST_CELLS: f64 = 1e7;

/// Straight ways of one cutter, each of some strand.
pub(crate) struct Ways {
    cutter: Cutter,
    origin: [f64; 2],
    cell_mm: f64,
    shape: [usize; 2],
    cells: Vec<Cell>,
    ways: Vec<(Way, usize)>,
}

/// Ways that run over a square, and the lowest that they get.
#[derive(Clone)]
struct Cell {
    lowest_mm: f64,
    ways: Vec<u32>,
}

/// What is left at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    pub(crate) height_mm: f64,
    /// The tip that leaves it.
    pub(crate) tip_mm: [f64; 3],
    /// The strand that it is on.
    pub(crate) strand: usize,
    way: u32,
}

impl Ways {
    /// None yet, over a rectangle.
    pub(crate) fn new(cutter: Cutter, low: [f64; 2], high: [f64; 2]) -> Self {
        let sides = [0, 1].map(|k| (high[k] - low[k]).max(0.0));
        let least = (sides[0] * sides[1] / MOST_CELLS).sqrt();
        let cell_mm = (cutter.radius_mm() / CELLS).max(least);
        let shape = sides.map(|side| (side / cell_mm) as usize + 1);
        let empty = Cell {
            lowest_mm: f64::INFINITY,
            ways: Vec::new(),
        };
        Self {
            cutter,
            origin: low,
            cell_mm,
            shape,
            cells: vec![empty; shape[0] * shape[1]],
            ways: Vec::new(),
        }
    }

    /// Adds the straight ways between points.
    pub(crate) fn add(&mut self, points: &[[f64; 3]], strand: usize) {
        for pair in points.windows(2) {
            let &[a, b] = pair else { continue };
            let length = libm::hypot(b[0] - a[0], b[1] - a[1]);
            // Short ones lie in few cells.
            let count = (length / self.cell_mm).ceil().max(1.0);
            let point = |k: f64| -> [f64; 3] {
                if k >= count {
                    return b;
                }
                std::array::from_fn(|i| a[i] + k / count * (b[i] - a[i]))
            };
            for k in 0..count as usize {
                self.add_one(point(k as f64), point(k as f64 + 1.0), strand);
            }
        }
    }

    fn add_one(&mut self, a: [f64; 3], b: [f64; 3], strand: usize) {
        let index = self.ways.len() as u32;
        let way = Way::new(a, b);
        let [columns, rows] = [0, 1].map(|k| self.range(k, a[k].min(b[k]), a[k].max(b[k])));
        for column in columns {
            for row in rows.clone() {
                let cell = &mut self.cells[column * self.shape[1] + row];
                cell.lowest_mm = cell.lowest_mm.min(way.lowest_mm);
                cell.ways.push(index);
            }
        }
        self.ways.push((way, strand));
    }

    /// Cells along an axis that a stretch touches.
    fn range(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let cell = |at: f64| ((at - self.origin[axis]) / self.cell_mm).max(0.0) as usize;
        let last = self.shape[axis] - 1;
        cell(low).min(last)..cell(high).min(last) + 1
    }

    /// The lowest that any way leaves at a place; `None` where none reaches it. What was left near by
    /// is a good guess.
    pub(crate) fn left(&self, at: [f64; 2], guess: Option<&Left>) -> Option<Left> {
        let mut best: Option<Left> = None;
        let mut ceiling = f64::INFINITY;
        let mut look = |index: u32, ceiling: &mut f64| {
            let (way, strand) = &self.ways[index as usize];
            if way.lowest_mm >= *ceiling {
                return;
            }
            if let Some((height_mm, along)) = way.leaves(&self.cutter, at, *ceiling) {
                *ceiling = height_mm;
                best = Some(Left {
                    height_mm,
                    tip_mm: way.tip_mm(along),
                    strand: *strand,
                    way: index,
                });
            }
        };
        if let Some(guess) = guess {
            look(guess.way, &mut ceiling);
        }
        let radius = self.cutter.radius_mm();
        let [columns, rows] = [0, 1].map(|k| self.range(k, at[k] - radius, at[k] + radius));
        for column in columns {
            let beside = self.beside(0, column, at[0]);
            for row in rows.clone() {
                let cell = &self.cells[column * self.shape[1] + row];
                if cell.lowest_mm >= ceiling {
                    continue;
                }
                let off = self.beside(1, row, at[1]);
                let square = beside * beside + off * off;
                if square > radius * radius
                    || cell.lowest_mm + self.cutter.profile(square.sqrt()) >= ceiling
                {
                    continue;
                }
                for way in &cell.ways {
                    look(*way, &mut ceiling);
                }
            }
        }
        best
    }

    /// How far a coordinate is beside a cell; what lies beyond the grid is in its outermost cells.
    fn beside(&self, axis: usize, cell: usize, at: f64) -> f64 {
        let low = self.origin[axis] + cell as f64 * self.cell_mm;
        let high = low + self.cell_mm;
        let is_first = cell == 0;
        let is_last = cell + 1 == self.shape[axis];
        let below = if is_first { 0.0 } else { (low - at).max(0.0) };
        let above = if is_last { 0.0 } else { (at - high).max(0.0) };
        below.max(above)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_of_all_ways_is_found_with_and_without_a_guess() {
        let cutter = Cutter::ball(3.0).unwrap();
        let mut ways = Ways::new(cutter, [0.0; 2], [20.0, 10.0]);
        let mut all = Vec::new();
        for k in 0..40_u32 {
            let t = f64::from(k);
            let a = [
                10.0 + 9.0 * libm::sin(t),
                5.0 + 5.0 * libm::cos(1.7 * t),
                0.1 * libm::sin(5.0 * t),
            ];
            let b = [
                10.0 + 9.0 * libm::sin(t + 0.4),
                5.0 + 4.0 * libm::cos(1.7 * t + 0.3),
                0.0,
            ];
            ways.add(&[a, b], k as usize);
            all.push(Way::new(a, b));
        }
        let mut guess = None;
        for k in 0..2000_u32 {
            let at = [
                0.01 * f64::from(k),
                5.0 + 4.9 * libm::sin(0.37 * f64::from(k)),
            ];
            let forced = all
                .iter()
                .enumerate()
                .filter_map(|(k, way)| Some((way.leaves(&cutter, at, f64::INFINITY)?.0, k)))
                .fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
            let left = ways.left(at, guess.as_ref());
            assert_eq!(left.is_some(), forced.0.is_finite(), "{at:?}");
            if let Some(left) = left {
                assert!((left.height_mm - forced.0).abs() < 1e-9, "{at:?}");
                assert!(left.strand == forced.1 || (left.height_mm - forced.0).abs() < 1e-9);
            }
            guess = left;
        }
    }
}
