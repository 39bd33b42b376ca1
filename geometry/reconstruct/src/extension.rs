//! Extension of a region to a full rectangle (Shim & Lee 1995, section III).
//!
//! A smooth surface cannot follow the step between a region and its background. So the
//! background within the rectangle takes on values that carry the region on: its border
//! values outward along the vertical, and straight lines across gaps within a column.

use range_image::RangeImage;

/// A rectangle of grid nodes; it may reach beyond the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodeRectangle {
    /// First column, counted as in the image.
    pub column_first: i64,
    /// First row, counted as in the image.
    pub row_first: i64,
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
}

/// z at every node of a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtendedRegion {
    /// Where it lies.
    pub rectangle: NodeRectangle,
    /// z column by column, upwards within a column, millimetres.
    pub z_mm: Vec<f64>,
}

impl ExtendedRegion {
    /// z at a node of the rectangle, counted from its lower left one, millimetres.
    ///
    /// # Panics
    /// When the node lies outside the rectangle.
    #[must_use]
    pub fn z(&self, column: usize, row: usize) -> f64 {
        self.z_mm[column * self.rectangle.rows + row]
    }
}

/// The smallest rectangle that holds every member; `None` when there is none.
#[must_use]
pub fn bounding_rectangle(
    image: &RangeImage,
    member: impl Fn(usize, usize) -> bool,
) -> Option<NodeRectangle> {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for column in 0..image.columns() {
        for row in (0..image.rows()).filter(|&row| member(column, row)) {
            low = [low[0].min(column), low[1].min(row)];
            high = [high[0].max(column), high[1].max(row)];
        }
    }
    (low[0] <= high[0] && low[1] <= high[1]).then(|| NodeRectangle {
        column_first: low[0] as i64,
        row_first: low[1] as i64,
        columns: high[0] - low[0] + 1,
        rows: high[1] - low[1] + 1,
    })
}

/// Values for every node of the rectangle from the members with a z; `None` when no such
/// member lies in its columns. A column without a member repeats the nearest one that
/// has some, the left one of two.
#[must_use]
pub fn extend(
    image: &RangeImage,
    member: impl Fn(usize, usize) -> bool,
    rectangle: NodeRectangle,
) -> Option<ExtendedRegion> {
    let mut columns: Vec<Option<Vec<f64>>> = Vec::with_capacity(rectangle.columns);
    for k in 0..rectangle.columns {
        let known = usize::try_from(rectangle.column_first + k as i64)
            .ok()
            .map(|column| {
                (0..image.rows())
                    .filter(|&row| member(column, row))
                    .filter_map(|row| Some((row as i64, image.z_mm(column, row)?)))
                    .collect::<Vec<_>>()
            });
        columns.push(
            known
                .filter(|k| !k.is_empty())
                .map(|k| filled(&k, rectangle)),
        );
    }
    let present: Vec<usize> = (0..columns.len())
        .filter(|&k| columns[k].is_some())
        .collect();
    let mut z_mm = Vec::with_capacity(rectangle.columns * rectangle.rows);
    for k in 0..columns.len() {
        let nearest = present.iter().min_by_key(|&&p| p.abs_diff(k))?;
        z_mm.extend_from_slice(columns[*nearest].as_deref()?);
    }
    Some(ExtendedRegion { rectangle, z_mm })
}

/// A column of the rectangle from the known nodes of that column, upwards.
fn filled(known: &[(i64, f64)], rectangle: NodeRectangle) -> Vec<f64> {
    let mut after = 0;
    (0..rectangle.rows as i64)
        .map(|k| {
            let row = rectangle.row_first + k;
            while after < known.len() && known[after].0 < row {
                after += 1;
            }
            match (after.checked_sub(1).map(|b| known[b]), known.get(after)) {
                (_, Some(&(r, z))) if r == row => z,
                (Some((r0, z0)), Some(&(r1, z1))) => {
                    z0 + (z1 - z0) * (row - r0) as f64 / (r1 - r0) as f64
                }
                (Some((_, z)), None) | (None, Some(&(_, z))) => z,
                (None, None) => f64::NAN,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::Lattice;

    #[test]
    fn borders_go_outward_and_gaps_are_bridged() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 4, 8);
        for (column, row, z) in [
            (1, 2, 10.0),
            (1, 3, 12.0),
            (1, 6, 18.0),
            (2, 4, 7.0),
            (3, 0, 99.0),
        ] {
            image.set_z_mm(column, row, Some(z));
        }
        let member = |column: usize, row: usize| column < 3 && image.z_mm(column, row).is_some();
        let tight = bounding_rectangle(&image, member).unwrap();
        assert_eq!(
            tight,
            NodeRectangle {
                column_first: 1,
                row_first: 2,
                columns: 2,
                rows: 5
            }
        );
        let wide = NodeRectangle {
            column_first: -1,
            row_first: 0,
            columns: 5,
            rows: 8,
        };
        let extended = extend(&image, member, wide).unwrap();
        let first = [10.0, 10.0, 10.0, 12.0, 14.0, 16.0, 18.0, 18.0];
        for (column, expected) in [
            (0, first),
            (1, first),
            (2, first),
            (3, [7.0; 8]),
            (4, [7.0; 8]),
        ] {
            for (row, z) in expected.into_iter().enumerate() {
                assert!(
                    (extended.z(column, row) - z).abs() < 1e-12,
                    "{column} {row}"
                );
            }
        }
    }

    #[test]
    fn nothing_cannot_be_extended() {
        let image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 2, 2);
        assert!(bounding_rectangle(&image, |_, _| false).is_none());
        let rectangle = NodeRectangle {
            column_first: 0,
            row_first: 0,
            columns: 2,
            rows: 2,
        };
        assert!(extend(&image, |_, _| true, rectangle).is_none());
    }
}
