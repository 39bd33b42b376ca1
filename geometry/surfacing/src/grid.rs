//! The data: z at the nodes of a uniform grid, some of them masked.

use core::ops::Range;

use range_image::{Column, Lattice, RangeImage};

use crate::error::SurfaceError;

/// Fewest nodes along a side: a cubic needs four.
pub const FEWEST_NODES: usize = 4;

/// How far off its node a sample of a uniform grid may lie, pitches.
const OFF_NODE: f64 = 0.02;
/// Most nodes along a side that samples are taken for a grid of.
const MOST_SIDE: f64 = 65_536.0;
/// Nodes for each sample, at most, for them to be a grid with holes.
const SPARSE: usize = 4;

/// z at the nodes of a uniform grid. Node `(i, j)` lies at `x = x_first + i pitch`,
/// `y = y_first + j pitch`; masked nodes have no z.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightGrid {
    pitch_mm: f64,
    first_mm: [f64; 2],
    columns: usize,
    rows: usize,
    z_mm: Vec<f64>,
}

impl HeightGrid {
    /// A grid from its values, column by column upwards, NaN where masked.
    ///
    /// # Errors
    /// [`SurfaceError`] when there are fewer than four nodes along a side, none has a value,
    /// the number of values does not match or a value is infinite.
    pub fn new(
        pitch_mm: f64,
        first_mm: [f64; 2],
        columns: usize,
        rows: usize,
        z_mm: Vec<f64>,
    ) -> Result<Self, SurfaceError> {
        if !(pitch_mm > 0.0 && pitch_mm.is_finite()) {
            return Err(SurfaceError::Pitch { pitch_mm });
        }
        if columns < FEWEST_NODES || rows < FEWEST_NODES {
            return Err(SurfaceError::TooFewNodes { columns, rows });
        }
        if z_mm.len() != columns * rows {
            return Err(SurfaceError::Count {
                needed: columns * rows,
                given: z_mm.len(),
            });
        }
        if let Some(index) = z_mm.iter().position(|z| z.is_infinite()) {
            return Err(SurfaceError::Infinite {
                column: index / rows,
                row: index % rows,
            });
        }
        if z_mm.iter().all(|z| z.is_nan()) {
            return Err(SurfaceError::AllMasked);
        }
        Ok(Self {
            pitch_mm,
            first_mm,
            columns,
            rows,
            z_mm,
        })
    }

    /// The part of a range image that holds all its nodes with a value.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_image(image: &RangeImage) -> Result<Self, SurfaceError> {
        let (columns, rows) = (image.columns(), image.rows());
        let raw = image.raw_z_mm();
        let mut bounds: Option<(Range<usize>, Range<usize>)> = None;
        for (index, _) in raw.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let (i, j) = (index / rows, index % rows);
            let (is, js) = bounds.get_or_insert((i..i + 1, j..j + 1));
            *is = is.start.min(i)..is.end.max(i + 1);
            *js = js.start.min(j)..js.end.max(j + 1);
        }
        let Some((is, js)) = bounds else {
            return Err(SurfaceError::AllMasked);
        };
        debug_assert!(is.end <= columns && js.end <= rows);
        let z_mm = is
            .clone()
            .flat_map(|i| raw[i * rows + js.start..i * rows + js.end].iter().copied())
            .collect();
        Self::new(
            image.pitch_mm(),
            [image.x_mm(is.start), image.y_mm(js.start)],
            is.len(),
            js.len(),
            z_mm,
        )
    }

    /// The samples as they are, where they lie on a uniform grid already, one at a node: columns
    /// and samples within a fiftieth of the pitch of it. `None` where they do not.
    #[must_use]
    pub fn from_columns(columns: &[Column]) -> Option<Self> {
        let mut steps: Vec<f64> = columns
            .iter()
            .flat_map(|column| column.samples().windows(2))
            .filter_map(|pair| Some(pair.get(1)?.y_mm - pair.first()?.y_mm))
            .collect();
        let middle = steps.len() / 2;
        let pitch_mm = match steps.is_empty() {
            true => return None,
            false => *steps.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        if !(pitch_mm > 0.0 && pitch_mm.is_finite()) {
            return None;
        }
        // Over the longest column, so that the rounding of coordinates in a file does not add up.
        let lengths = columns.iter().filter_map(Column::y_extent_mm);
        let length_mm = lengths.map(|(low, high)| high - low).fold(0.0, f64::max);
        let pitch_mm = length_mm / (length_mm / pitch_mm).round();
        let filled = || columns.iter().filter(|column| !column.samples().is_empty());
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let x_mm = least(&mut filled().map(Column::x_mm));
        let y_mm = least(&mut filled().filter_map(|c| c.y_extent_mm()).map(|e| e.0));
        let node = |at: f64, first: f64| {
            let index = (at - first) / pitch_mm;
            let nearest = index.round();
            ((index - nearest).abs() <= OFF_NODE && nearest <= MOST_SIDE)
                .then_some(nearest as usize)
        };
        let mut nodes = Vec::new();
        for column in filled() {
            let i = node(column.x_mm(), x_mm)?;
            for sample in column.samples() {
                nodes.push((i, node(sample.y_mm, y_mm)?, sample.z_mm));
            }
        }
        let count = |side: &mut dyn Iterator<Item = usize>| side.max().map_or(0, |last| last + 1);
        let columns = count(&mut nodes.iter().map(|node| node.0));
        let rows = count(&mut nodes.iter().map(|node| node.1));
        // Scattered points on a fine lattice are no grid.
        if columns.checked_mul(rows)? > SPARSE * nodes.len() {
            return None;
        }
        let mut z_mm = vec![f64::NAN; columns * rows];
        for (i, j, z) in nodes {
            let place = z_mm.get_mut(i * rows + j)?;
            if !place.is_nan() {
                return None;
            }
            *place = z;
        }
        Self::new(pitch_mm, [x_mm, y_mm], columns, rows, z_mm).ok()
    }

    /// The same nodes with other values, masked where these are NaN.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_z(&self, z_mm: Vec<f64>) -> Result<Self, SurfaceError> {
        Self::new(self.pitch_mm, self.first_mm, self.columns, self.rows, z_mm)
    }

    /// The nodes of these columns and rows; `None` when they are fewer than four along a
    /// side, or all masked.
    #[must_use]
    pub fn block(&self, columns: Range<usize>, rows: Range<usize>) -> Option<Self> {
        if columns.end > self.columns || rows.end > self.rows {
            return None;
        }
        let z_mm = columns
            .clone()
            .flat_map(|i| {
                self.column(i)
                    .get(rows.clone())
                    .unwrap_or_default()
                    .iter()
                    .copied()
            })
            .collect();
        let first_mm = [self.x_mm(columns.start), self.y_mm(rows.start)];
        Self::new(self.pitch_mm, first_mm, columns.len(), rows.len(), z_mm).ok()
    }

    /// The same as a range image, for a grid on the lattice of one.
    #[must_use]
    pub fn to_image(&self) -> RangeImage {
        let lattice = Lattice {
            pitch_mm: self.pitch_mm,
        };
        let [i, j] = self.first_mm.map(|mm| (mm / self.pitch_mm).round() as i64);
        let mut image = RangeImage::masked(lattice, i, j, self.columns, self.rows);
        for (n, &z) in self.z_mm.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            image.set_z_mm(n / self.rows, n % self.rows, Some(z));
        }
        image
    }

    /// Distance of neighbouring nodes, millimetres.
    #[must_use]
    pub fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    /// Number of columns (nodes along x).
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows (nodes along y).
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// x of a column, millimetres.
    #[must_use]
    pub fn x_mm(&self, column: usize) -> f64 {
        self.first_mm[0] + column as f64 * self.pitch_mm
    }

    /// y of a row, millimetres.
    #[must_use]
    pub fn y_mm(&self, row: usize) -> f64 {
        self.first_mm[1] + row as f64 * self.pitch_mm
    }

    /// All values, column by column upwards; NaN where masked.
    #[must_use]
    pub fn raw_z_mm(&self) -> &[f64] {
        &self.z_mm
    }

    /// The values of a column upwards; empty beyond the grid.
    #[must_use]
    pub fn column(&self, column: usize) -> &[f64] {
        let start = column * self.rows;
        self.z_mm.get(start..start + self.rows).unwrap_or_default()
    }

    /// The values of a row along x.
    #[must_use]
    pub fn row(&self, row: usize) -> Vec<f64> {
        (0..self.columns)
            .filter_map(|i| self.column(i).get(row).copied())
            .collect()
    }

    /// Number of nodes that have a value.
    #[must_use]
    pub fn valid_nodes(&self) -> usize {
        self.z_mm.iter().filter(|z| !z.is_nan()).count()
    }

    /// Whether every node has a value.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.z_mm.iter().all(|z| !z.is_nan())
    }

    /// Standard deviation of independent noise, millimetres: from the median of the fourth
    /// differences along both directions, in which smooth shape all but vanishes. 0 where
    /// there are too few nodes to tell.
    #[must_use]
    pub fn noise_mm(&self) -> f64 {
        // Squares of the binomials 1 4 6 4 1.
        let gain = 70.0_f64.sqrt();
        let mut differences = Vec::new();
        let fourth = |z: [f64; 5]| (z[0] - 4.0 * z[1] + 6.0 * z[2] - 4.0 * z[3] + z[4]).abs();
        for i in 0..self.columns {
            let column = self.column(i);
            for window in column.windows(5) {
                differences.push(fourth([
                    window[0], window[1], window[2], window[3], window[4],
                ]));
            }
            if i + 4 < self.columns {
                for j in 0..self.rows {
                    let at = |k: usize| self.z_mm[(i + k) * self.rows + j];
                    differences.push(fourth([at(0), at(1), at(2), at(3), at(4)]));
                }
            }
        }
        differences.retain(|d| d.is_finite());
        if differences.is_empty() {
            return 0.0;
        }
        let middle = differences.len() / 2;
        let (_, median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
        *median / 0.674_489_75 / gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Sample;

    #[test]
    fn an_image_is_cropped_to_what_it_holds() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -4, 2, 12, 10);
        for i in 3..9 {
            for j in 1..6 {
                image.set_z_mm(i, j, Some((i * 10 + j) as f64));
            }
        }
        image.set_z_mm(4, 3, None);
        let grid = HeightGrid::from_image(&image).unwrap();
        assert_eq!(
            (grid.columns(), grid.rows(), grid.valid_nodes()),
            (6, 5, 29)
        );
        assert_eq!((grid.x_mm(0), grid.y_mm(0)), (-0.5, 1.5));
        assert_eq!(grid.column(0)[0], 31.0);
        assert!(grid.column(1)[2].is_nan());
        assert_eq!(grid.row(0)[5], 81.0);
        let again = grid.to_image();
        assert_eq!((again.origin(), again.z_mm(5, 0)), ((-1, 3), Some(81.0)));
        assert_eq!(again.valid_nodes(), 29);
    }

    #[test]
    fn samples_on_a_grid_are_taken_as_they_are() {
        let column = |i: usize, off: f64| {
            let samples = (0..7).filter(|j| (i, *j) != (2, 3)).map(|j| Sample {
                y_mm: 4.3 + 2.0 * j as f64 + off,
                z_mm: (10 * i + j) as f64,
                intensity: 255,
            });
            Column::new(-1.1 + 2.0 * i as f64, samples.collect())
        };
        let columns: Vec<Column> = (0..5).map(|i| column(i, 0.0)).collect();
        let grid = HeightGrid::from_columns(&columns).unwrap();
        assert_eq!((grid.columns(), grid.rows(), grid.pitch_mm()), (5, 7, 2.0));
        assert_eq!((grid.x_mm(0), grid.y_mm(0)), (-1.1, 4.3));
        assert_eq!((grid.column(3)[6], grid.valid_nodes()), (36.0, 34));
        let uneven: Vec<Column> = (0..5).map(|i| column(i, 0.3 * i as f64)).collect();
        assert_eq!(HeightGrid::from_columns(&uneven), None);
        assert_eq!(HeightGrid::from_columns(&[]), None);
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let masked = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 9, 9);
        assert_eq!(
            HeightGrid::from_image(&masked).unwrap_err(),
            SurfaceError::AllMasked
        );
        assert_eq!(
            HeightGrid::new(1.0, [0.0; 2], 3, 9, vec![0.0; 27]).unwrap_err(),
            SurfaceError::TooFewNodes {
                columns: 3,
                rows: 9
            }
        );
        let mut z = vec![0.0; 16];
        z[6] = f64::INFINITY;
        assert_eq!(
            HeightGrid::new(1.0, [0.0; 2], 4, 4, z).unwrap_err(),
            SurfaceError::Infinite { column: 1, row: 2 }
        );
    }
}
