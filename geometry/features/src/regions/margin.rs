//! A margin of nodes without a value around the image, so that what ends at its frame has a border.

use range_image::RangeImage;

use super::{MARGIN, NONE};

/// The image and its labels with the margin around.
pub(super) fn with_margin(image: &RangeImage, labels: &[u16]) -> (RangeImage, Vec<u16>) {
    let (columns, rows) = (image.columns(), image.rows());
    let (i, j) = image.origin();
    let more = MARGIN as i64;
    let (wide, tall) = (columns + 2 * MARGIN, rows + 2 * MARGIN);
    let mut padded = RangeImage::masked(image.lattice(), i - more, j - more, wide, tall);
    let mut moved = vec![NONE; wide * tall];
    for column in 0..columns {
        for row in 0..rows {
            padded.set_z_mm(column + MARGIN, row + MARGIN, image.z_mm(column, row));
            moved[(column + MARGIN) * tall + row + MARGIN] = labels[column * rows + row];
        }
    }
    (padded, moved)
}
