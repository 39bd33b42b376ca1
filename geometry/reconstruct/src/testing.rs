//! Small pictures for tests.

use range_image::RegionMap;
use range_image::image::{Lattice, RangeImage};

/// An image of z = 0 and its map from rows of letters, the top row first; `.` is nothing.
pub(crate) fn pictured(picture: &[&str]) -> (RangeImage, RegionMap) {
    let (rows, columns) = (picture.len(), picture[0].len());
    let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, columns, rows);
    let mut labels = vec![0; columns * rows];
    for (k, line) in picture.iter().enumerate() {
        for (column, letter) in line.bytes().enumerate() {
            if letter != b'.' {
                let row = rows - 1 - k;
                image.set_z_mm(column, row, Some(0.0));
                labels[column * rows + row] = u16::from(letter - b'a') + 1;
            }
        }
    }
    let map = RegionMap::new(&image, labels);
    (image, map)
}

pub(crate) fn region_map(picture: &[&str]) -> RegionMap {
    pictured(picture).1
}
