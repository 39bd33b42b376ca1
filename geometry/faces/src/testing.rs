//! A scan for the tests of this crate.

use nalgebra::Vector3;
use range_image::{Lattice, NodeQuality, RangeImage};
use shapes::Sample;

use crate::observations::Observations;

/// A scan of a surface, z by x and y in millimetres: a sample at each node, with noise of this
/// deviation.
pub(crate) struct Scan {
    pub(crate) image: RangeImage,
    pub(crate) observations: Observations,
}

impl Scan {
    pub(crate) fn of(
        (columns, rows): (usize, usize),
        pitch_mm: f64,
        sigma_mm: f64,
        z_mm: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let mut image = RangeImage::masked(Lattice { pitch_mm }, 0, 0, columns, rows);
        let mut samples = Vec::new();
        for node in 0..columns * rows {
            let (column, row) = (node / rows, node % rows);
            let true_mm = z_mm(image.x_mm(column), image.y_mm(row));
            let z_mm = true_mm + sigma_mm * stray(node);
            // A node is the middle of many samples.
            image.set_z_mm(column, row, Some(0.8 * true_mm + 0.2 * z_mm));
            let quality = NodeQuality {
                inliers: 30,
                samples: 32,
                scale_mm: sigma_mm as f32,
                nearest_mm: 0.0,
            };
            image.set_quality(column, row, quality);
            let sample = Sample {
                point_mm: Vector3::new(image.x_mm(column), image.y_mm(row), z_mm),
                ray: Vector3::z(),
                sigma_mm,
            };
            samples.push((node, sample));
        }
        let observations = Observations::new(columns * rows, &samples, 1.0);
        Self {
            image,
            observations,
        }
    }
}

/// Of variance 1, and in no order.
fn stray(node: usize) -> f64 {
    let turned = (node as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (turned ^ (turned >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40;
    1.73 * (mixed as f64 / f64::from(1 << 23) - 1.0)
}
