//! The range image that a scanner without noise or mistakes would give.

use range_image::RangeImage;
use sim_scanner::scanner::Scanner;
use sim_scanner::truth::graph_node;

/// z of the visible surface at the nodes of a grid that holds an image and the whole object.
#[derive(Debug, Clone)]
pub(crate) struct TrueImage {
    /// Masked where nothing is seen.
    pub(crate) image: RangeImage,
    /// Which face of the solid is seen, in the order of [`RangeImage::raw_z_mm`].
    faces: Vec<Option<usize>>,
}

impl TrueImage {
    pub(crate) fn around(image: &RangeImage, scanner: &Scanner) -> Self {
        let (low, high) = scanner.scene.object_extent_mm();
        let lattice = image.lattice();
        let (i, j) = image.origin();
        let first = (
            i.min(lattice.first_at_or_above(low.x)),
            j.min(lattice.first_at_or_above(low.y)),
        );
        let end = (
            (i + image.columns() as i64).max(lattice.last_at_or_below(high.x) + 1),
            (j + image.rows() as i64).max(lattice.last_at_or_below(high.y) + 1),
        );
        let (columns, rows) = ((end.0 - first.0) as usize, (end.1 - first.1) as usize);
        let mut truth = RangeImage::masked(lattice, first.0, first.1, columns, rows);
        let mut faces = vec![None; columns * rows];
        for column in 0..columns {
            for row in 0..rows {
                let seen = graph_node(scanner, truth.x_mm(column), truth.y_mm(row));
                if let Some(node) = seen.filter(|node| node.seen) {
                    truth.set_z_mm(column, row, Some(node.z_mm));
                    faces[column * rows + row] = Some(node.face.face);
                }
            }
        }
        Self {
            image: truth,
            faces,
        }
    }

    /// Another image of the same lattice on this grid; what lies outside is lost.
    pub(crate) fn on_this_grid(&self, other: &RangeImage) -> RangeImage {
        let mut placed = self.image.masked_like();
        let (columns, rows) = (placed.columns(), placed.rows());
        for column in 0..other.columns() {
            for row in 0..other.rows() {
                let (c, r) = self.node(other, column, row);
                if c < columns && r < rows {
                    placed.set_z_mm(c, r, other.z_mm(column, row));
                }
            }
        }
        placed
    }

    /// z and face at a node of an image of the same lattice; `None` where nothing is seen.
    pub(crate) fn at(&self, image: &RangeImage, column: usize, row: usize) -> Option<(f64, usize)> {
        let (c, r) = self.node(image, column, row);
        if c >= self.image.columns() || r >= self.image.rows() {
            return None;
        }
        let face = *self.faces.get(c * self.image.rows() + r)?;
        Some((self.image.z_mm(c, r)?, face?))
    }

    /// Number of nodes at which a face is seen.
    pub(crate) fn nodes_of(&self, face: usize) -> usize {
        self.faces.iter().filter(|f| **f == Some(face)).count()
    }

    /// A node of another image, counted from the first one here.
    fn node(&self, other: &RangeImage, column: usize, row: usize) -> (usize, usize) {
        let (here, there) = (self.image.origin(), other.origin());
        let index = |k: usize, here: i64, there: i64| {
            usize::try_from(k as i64 + there - here).unwrap_or(usize::MAX)
        };
        (index(column, here.0, there.0), index(row, here.1, there.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;
    use sim_scanner::source::Source;

    use crate::conditions::Subject;

    fn scanner() -> Scanner {
        let source = Subject::Cylinder.config(1).source().unwrap();
        let Source::Simulated { scanner, .. } = source else {
            unreachable!("it is simulated");
        };
        *scanner
    }

    #[test]
    fn the_grid_holds_the_object_and_the_image_alike() {
        let scanner = scanner();
        let image = RangeImage::masked(Lattice { pitch_mm: 2.0 }, -40, 3, 10, 5);
        let truth = TrueImage::around(&image, &scanner);
        let (low, high) = scanner.scene.object_extent_mm();
        let (columns, rows) = (truth.image.columns(), truth.image.rows());
        assert!(truth.image.x_mm(0) <= -80.0 && truth.image.x_mm(columns - 1) > high.x - 2.0);
        assert!(truth.image.y_mm(0) < low.y + 2.0 && truth.image.y_mm(rows - 1) > high.y - 2.0);
        let (side, top) = (truth.nodes_of(0), truth.nodes_of(1));
        assert_eq!(side + top, truth.image.valid_nodes());
        assert!(side > 300 && top > 300, "{side} {top}");
    }

    #[test]
    fn nodes_of_another_image_keep_their_place() {
        let scanner = scanner();
        let mut image = RangeImage::masked(Lattice { pitch_mm: 2.0 }, -3, -2, 6, 6);
        image.set_z_mm(4, 1, Some(7.0));
        let truth = TrueImage::around(&image, &scanner);
        let placed = truth.on_this_grid(&image);
        assert_eq!(placed.valid_nodes(), 1);
        let column = (0..placed.columns()).find(|&c| placed.x_mm(c) == image.x_mm(4));
        let row = (0..placed.rows()).find(|&r| placed.y_mm(r) == image.y_mm(1));
        let (column, row) = (column.unwrap(), row.unwrap());
        assert_eq!(placed.z_mm(column, row), Some(7.0));
        assert_eq!(
            truth.at(&image, 4, 1).map(|(z, _)| z),
            truth.image.z_mm(column, row)
        );
        let far = RangeImage::masked(Lattice { pitch_mm: 2.0 }, -3000, 0, 1, 1);
        assert_eq!(truth.at(&far, 0, 0), None);
    }
}
