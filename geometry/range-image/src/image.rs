//! The uniform range image and the lattice it lives on.

use crate::quality::NodeQuality;

/// The lattice of grid nodes: node `(i, j)` lies at `(i * pitch, j * pitch)`.
///
/// It is anchored at the part frame's origin, not at the first sample, so that neither
/// the start of a scan nor its batching can move a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Distance of neighbouring nodes in x and in y, millimetres, positive and finite.
    pub pitch_mm: f64,
}

impl Lattice {
    /// x or y of the lattice line with this index, millimetres.
    #[must_use]
    pub fn line_mm(self, index: i64) -> f64 {
        index as f64 * self.pitch_mm
    }

    /// Index of the first line at or above this coordinate.
    #[must_use]
    pub fn first_at_or_above(self, coordinate_mm: f64) -> i64 {
        (coordinate_mm / self.pitch_mm).ceil() as i64
    }

    /// Index of the last line at or below this coordinate.
    #[must_use]
    pub fn last_at_or_below(self, coordinate_mm: f64) -> i64 {
        (coordinate_mm / self.pitch_mm).floor() as i64
    }
}

/// One finished column of grid nodes, as the regridder gives it out.
#[derive(Debug, Clone, PartialEq)]
pub struct GridColumn {
    /// Lattice index in x.
    pub i: i64,
    /// Lattice index in y of the first entry of `z_mm`.
    pub j_first: i64,
    /// z at successive nodes upwards, millimetres; NaN where the node is masked.
    pub z_mm: Vec<f64>,
    /// Quality of the same nodes; empty where it is not known. What it says of masked nodes
    /// has no meaning.
    pub quality: Vec<NodeQuality>,
}

/// z at the nodes of a uniform grid, with a mask: a node has a value or none.
///
/// Nodes are addressed by `(column, row)`, counted from the lower left corner; columns
/// follow the slide table, rows go up. Values are kept column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeImage {
    lattice: Lattice,
    i_first: i64,
    j_first: i64,
    columns: usize,
    rows: usize,
    z_mm: Vec<f64>,
    /// Empty, or as long as `z_mm`.
    quality: Vec<NodeQuality>,
}

impl RangeImage {
    /// An image with every node masked.
    #[must_use]
    pub fn masked(
        lattice: Lattice,
        i_first: i64,
        j_first: i64,
        columns: usize,
        rows: usize,
    ) -> Self {
        Self {
            lattice,
            i_first,
            j_first,
            columns,
            rows,
            z_mm: vec![f64::NAN; columns * rows],
            quality: Vec::new(),
        }
    }

    /// An image with the same grid and every node masked.
    #[must_use]
    pub fn masked_like(&self) -> Self {
        Self::masked(
            self.lattice,
            self.i_first,
            self.j_first,
            self.columns,
            self.rows,
        )
    }

    /// Distance of neighbouring nodes, millimetres.
    #[must_use]
    pub fn pitch_mm(&self) -> f64 {
        self.lattice.pitch_mm
    }

    /// The lattice the nodes lie on.
    #[must_use]
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// Lattice indices (i, j) of the node at column 0, row 0.
    #[must_use]
    pub fn origin(&self) -> (i64, i64) {
        (self.i_first, self.j_first)
    }

    /// Number of grid columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of nodes in a column.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// x of a grid column, millimetres. Columns beyond the image are extrapolated.
    #[must_use]
    pub fn x_mm(&self, column: usize) -> f64 {
        self.lattice.line_mm(self.i_first + column as i64)
    }

    /// y of a row, millimetres. Rows beyond the image are extrapolated.
    #[must_use]
    pub fn y_mm(&self, row: usize) -> f64 {
        self.lattice.line_mm(self.j_first + row as i64)
    }

    /// z at a node in millimetres; `None` where it is masked or outside the image.
    #[must_use]
    pub fn z_mm(&self, column: usize, row: usize) -> Option<f64> {
        if column >= self.columns || row >= self.rows {
            return None;
        }
        let z = self.z_mm[column * self.rows + row];
        (!z.is_nan()).then_some(z)
    }

    /// Quality of a node; `None` where it is masked or outside the image, or where nothing
    /// is known of it, as in images that no regridder made.
    #[must_use]
    pub fn quality(&self, column: usize, row: usize) -> Option<NodeQuality> {
        self.z_mm(column, row)?;
        let quality = self.quality.get(column * self.rows + row)?;
        (quality.samples > 0).then_some(*quality)
    }

    /// Notes the quality of a node, which may be masked.
    ///
    /// # Panics
    /// When the node lies outside the image.
    pub fn set_quality(&mut self, column: usize, row: usize, quality: NodeQuality) {
        assert!(
            column < self.columns && row < self.rows,
            "node outside the image"
        );
        self.quality.resize(self.z_mm.len(), NodeQuality::default());
        self.quality[column * self.rows + row] = quality;
    }

    /// Sets or masks (`None`) a node. Its quality, which told of the value before, is
    /// forgotten.
    ///
    /// # Panics
    /// When the node lies outside the image.
    pub fn set_z_mm(&mut self, column: usize, row: usize, z_mm: Option<f64>) {
        assert!(
            column < self.columns && row < self.rows,
            "node outside the image"
        );
        let index = column * self.rows + row;
        self.z_mm[index] = z_mm.unwrap_or(f64::NAN);
        if let Some(quality) = self.quality.get_mut(index) {
            *quality = NodeQuality::default();
        }
    }

    /// All values column by column, upwards within a column; NaN where masked.
    #[must_use]
    pub fn raw_z_mm(&self) -> &[f64] {
        &self.z_mm
    }

    /// The qualities of all nodes with a value of which one is known, column by column.
    pub fn qualities(&self) -> impl Iterator<Item = NodeQuality> {
        let valued = self.z_mm.iter().zip(&self.quality);
        valued
            .filter(|(z, quality)| !z.is_nan() && quality.samples > 0)
            .map(|(_, quality)| *quality)
    }

    /// Median of what the inliers at nodes stray by, millimetres: the noise of single samples; `None`
    /// where nothing is known of it.
    #[must_use]
    pub fn noise_mm(&self) -> Option<f64> {
        let mut scales: Vec<f32> = self.qualities().map(|own| own.scale_mm).collect();
        let middle = scales.len() / 2;
        (!scales.is_empty())
            .then(|| f64::from(*scales.select_nth_unstable_by(middle, f32::total_cmp).1))
    }

    /// Median share of the samples at a node that agree with it, 0 to 1; `None` where nothing is
    /// known of it.
    #[must_use]
    pub fn inlier_share(&self) -> Option<f64> {
        let mut shares: Vec<f64> = self.qualities().map(|own| own.inlier_share()).collect();
        let middle = shares.len() / 2;
        (!shares.is_empty()).then(|| *shares.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Number of nodes that have a value.
    #[must_use]
    pub fn valid_nodes(&self) -> usize {
        self.z_mm.iter().filter(|z| !z.is_nan()).count()
    }

    /// Least and greatest z in millimetres; `None` when every node is masked.
    #[must_use]
    pub fn z_extent_mm(&self) -> Option<(f64, f64)> {
        self.z_mm
            .iter()
            .filter(|z| !z.is_nan())
            .fold(None, |extent, &z| {
                Some(extent.map_or((z, z), |(low, high): (f64, f64)| (low.min(z), high.max(z))))
            })
    }
}

/// Gathers finished grid columns, in any order, into the smallest image that holds every
/// node with a value.
#[derive(Debug, Clone)]
pub struct RangeImageBuilder {
    lattice: Lattice,
    columns: Vec<GridColumn>,
}

impl RangeImageBuilder {
    /// A builder for columns of this lattice.
    #[must_use]
    pub fn new(lattice: Lattice) -> Self {
        Self {
            lattice,
            columns: Vec::new(),
        }
    }

    /// Adds a column; masked ends are dropped at once, so memory follows the part.
    pub fn push(&mut self, mut column: GridColumn) {
        let Some(last) = column.z_mm.iter().rposition(|z| !z.is_nan()) else {
            return;
        };
        if column.quality.len() != column.z_mm.len() {
            column.quality.clear();
        }
        column.z_mm.truncate(last + 1);
        column.quality.truncate(last + 1);
        let lead = column.z_mm.iter().take_while(|z| z.is_nan()).count();
        column.z_mm.drain(..lead);
        column.quality.drain(..lead.min(column.quality.len()));
        column.j_first += lead as i64;
        self.columns.push(column);
    }

    /// The image; zero columns and rows when no node had a value.
    #[must_use]
    pub fn finish(self) -> RangeImage {
        let i_range = self.columns.iter().map(|c| c.i);
        let (Some(i_first), Some(i_last)) = (i_range.clone().min(), i_range.max()) else {
            return RangeImage::masked(self.lattice, 0, 0, 0, 0);
        };
        let j_first = self.columns.iter().map(|c| c.j_first).min().unwrap_or(0);
        let j_end = self
            .columns
            .iter()
            .map(|c| c.j_first + c.z_mm.len() as i64)
            .max()
            .unwrap_or(j_first);
        let (columns, rows) = ((i_last - i_first + 1) as usize, (j_end - j_first) as usize);
        let mut image = RangeImage::masked(self.lattice, i_first, j_first, columns, rows);
        if self.columns.iter().any(|c| !c.quality.is_empty()) {
            image.quality = vec![NodeQuality::default(); image.z_mm.len()];
        }
        for column in &self.columns {
            let start = (column.i - i_first) as usize * rows + (column.j_first - j_first) as usize;
            image.z_mm[start..start + column.z_mm.len()].copy_from_slice(&column.z_mm);
            if !column.quality.is_empty() {
                image.quality[start..start + column.quality.len()].copy_from_slice(&column.quality);
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builder_crops_to_the_nodes_with_values() {
        let mut builder = RangeImageBuilder::new(Lattice { pitch_mm: 0.5 });
        let nan = f64::NAN;
        let of = |inliers| NodeQuality {
            inliers,
            samples: 8,
            scale_mm: 0.5,
            nearest_mm: 0.25,
        };
        builder.push(GridColumn {
            i: 4,
            j_first: -3,
            z_mm: vec![nan, 1.0, nan, 2.0, nan],
            quality: (0..5).map(of).collect(),
        });
        builder.push(GridColumn {
            i: 5,
            j_first: 0,
            z_mm: vec![nan, nan],
            quality: Vec::new(),
        });
        builder.push(GridColumn {
            i: 2,
            j_first: -1,
            z_mm: vec![3.0],
            quality: Vec::new(),
        });
        let mut image = builder.finish();
        assert_eq!(
            (image.columns(), image.rows(), image.origin()),
            (3, 3, (2, -2))
        );
        assert_eq!(image.z_mm(2, 0), Some(1.0));
        assert_eq!(image.z_mm(2, 1), None);
        assert_eq!(image.z_mm(0, 1), Some(3.0));
        assert_eq!((image.x_mm(0), image.y_mm(1)), (1.0, -0.5));
        assert_eq!(image.valid_nodes(), 3);
        assert_eq!(image.z_extent_mm(), Some((1.0, 3.0)));
        assert_eq!(image.quality(2, 0), Some(of(1)));
        assert_eq!(image.quality(2, 2), Some(of(3)));
        assert_eq!(of(3).inlier_share(), 0.375);
        assert_eq!(image.quality(2, 1), None, "masked");
        assert_eq!(image.quality(0, 1), None, "not known");
        assert_eq!(image.quality(2, 3), None, "outside");
        let inliers: Vec<u16> = image.qualities().map(|q| q.inliers).collect();
        assert_eq!(inliers, [1, 3]);
        image.set_z_mm(2, 0, Some(7.0));
        assert_eq!(image.quality(2, 0), None, "of another value");
        image.set_quality(0, 1, of(6));
        assert_eq!(image.quality(0, 1), Some(of(6)));
        assert_eq!(image.masked_like().quality(0, 1), None);
    }

    #[test]
    fn an_image_of_nothing_is_empty() {
        let image = RangeImageBuilder::new(Lattice { pitch_mm: 1.0 }).finish();
        assert_eq!(
            (image.columns(), image.rows(), image.z_extent_mm()),
            (0, 0, None)
        );
    }
}
