//! Edge detection by erosion residue (Shim & Lee 1995, section IV, equations 4 and 5).

use range_image::RegionMap;

/// Labels seen at a node: its own and the least of its neighbours'.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Residue {
    /// Label of the node itself.
    pub f: u16,
    /// Least label of its four neighbours; outside the image counts as 0.
    pub e: u16,
}

impl Residue {
    /// The residue `f - e` of equation 5, which is positive on border nodes. Negative
    /// where every neighbour has a higher label.
    #[must_use]
    pub fn value(self) -> i32 {
        i32::from(self.f) - i32::from(self.e)
    }

    /// True on border nodes. Of two regions that meet, the one with the higher label
    /// carries the border: it lies up to one node to that side of the true one.
    #[must_use]
    pub fn is_border(self) -> bool {
        self.f > self.e
    }
}

/// The residue at every node, in the order of [`RegionMap::raw_labels`]. Both labels are
/// kept, as the paper does, so that a border node also tells which regions meet there.
#[must_use]
pub fn erosion_residue(map: &RegionMap) -> Vec<Residue> {
    let mut residues = Vec::with_capacity(map.raw_labels().len());
    for column in 0..map.columns() {
        for row in 0..map.rows() {
            // Indices below the first wrap to a place outside, which reads as 0.
            let neighbours = [
                map.label(column, row.wrapping_sub(1)),
                map.label(column, row + 1),
                map.label(column.wrapping_sub(1), row),
                map.label(column + 1, row),
            ];
            residues.push(Residue {
                f: map.label(column, row),
                e: neighbours.into_iter().min().unwrap_or(0),
            });
        }
    }
    residues
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::{Lattice, RangeImage};

    #[test]
    fn borders_lie_on_the_side_of_the_higher_label() {
        // Five columns of six rows; columns 0-1 are region 1, 2-3 region 2, 4 nothing.
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 5, 6);
        let mut labels = vec![0; 30];
        for column in 0..4 {
            for row in 0..6 {
                image.set_z_mm(column, row, Some(0.0));
                labels[column * 6 + row] = 1 + (column / 2) as u16;
            }
        }
        let residues = erosion_residue(&RegionMap::new(&image, labels));
        let at = |column: usize, row: usize| residues[column * 6 + row];
        assert_eq!(at(1, 3), Residue { f: 1, e: 1 });
        assert!(
            !at(1, 3).is_border(),
            "the lower label does not see the higher"
        );
        assert_eq!(at(2, 3), Residue { f: 2, e: 1 });
        assert!(at(2, 3).is_border());
        assert_eq!(at(3, 3), Residue { f: 2, e: 0 });
        assert_eq!(
            at(0, 0),
            Residue { f: 1, e: 0 },
            "the image's rim is a border"
        );
        assert_eq!(at(4, 3).value(), 0);
    }
}
