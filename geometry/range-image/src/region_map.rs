//! Which surface region each node of a range image belongs to.

use crate::image::RangeImage;

/// A label for each node of a range image: 0 for none, `1..=regions()` for a region.
///
/// Labels are dense. Same addressing as [`RangeImage`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RegionMap {
    columns: usize,
    rows: usize,
    labels: Vec<u16>,
    regions: u16,
}

impl RegionMap {
    /// A map for the nodes of `image`, column by column as [`RangeImage::raw_z_mm`].
    /// Labels are made dense, numbered by where each is first met; masked nodes get 0.
    ///
    /// # Panics
    /// When there are not as many labels as nodes.
    #[must_use]
    pub fn new(image: &RangeImage, mut labels: Vec<u16>) -> Self {
        assert_eq!(
            labels.len(),
            image.raw_z_mm().len(),
            "one label for each node"
        );
        let mut dense = vec![0_u16; usize::from(u16::MAX) + 1];
        let mut regions = 0;
        for (label, z) in labels.iter_mut().zip(image.raw_z_mm()) {
            if z.is_nan() {
                *label = 0;
            }
            if *label != 0 {
                let entry = &mut dense[usize::from(*label)];
                if *entry == 0 {
                    regions += 1;
                    *entry = regions;
                }
                *label = *entry;
            }
        }
        Self {
            columns: image.columns(),
            rows: image.rows(),
            labels,
            regions,
        }
    }

    /// Label of a node; 0 for none, and outside the image.
    #[must_use]
    pub fn label(&self, column: usize, row: usize) -> u16 {
        if column < self.columns && row < self.rows {
            self.labels[column * self.rows + row]
        } else {
            0
        }
    }

    /// Gives a node to another region. Which numbers there are stays as it is.
    ///
    /// # Panics
    /// When the node is outside the image, or there is no such region.
    pub fn set_label(&mut self, column: usize, row: usize, label: u16) {
        assert!(
            column < self.columns && row < self.rows && label <= self.regions,
            "a node of the image, and a region"
        );
        self.labels[column * self.rows + row] = label;
    }

    /// Number of regions.
    #[must_use]
    pub fn regions(&self) -> u16 {
        self.regions
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

    /// All labels column by column, upwards within a column.
    #[must_use]
    pub fn raw_labels(&self) -> &[u16] {
        &self.labels
    }

    /// Number of nodes of each region; entry `k` is region `k + 1`.
    #[must_use]
    pub fn node_counts(&self) -> Vec<usize> {
        let mut counts = vec![0; usize::from(self.regions)];
        for &label in self.labels.iter().filter(|&&l| l != 0) {
            counts[usize::from(label) - 1] += 1;
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Lattice;

    #[test]
    fn labels_are_made_dense_in_order_of_appearance() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 2, 2);
        for (column, row) in [(0, 0), (0, 1), (1, 1)] {
            image.set_z_mm(column, row, Some(0.0));
        }
        let map = RegionMap::new(&image, vec![7, 3, 7, 3]);
        assert_eq!(map.raw_labels(), [1, 2, 0, 2]);
        assert_eq!(map.regions(), 2);
        assert_eq!(map.node_counts(), [1, 2]);
        assert_eq!(map.label(5, 0), 0);
    }
}
