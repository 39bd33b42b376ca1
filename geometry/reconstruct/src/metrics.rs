//! How well a restored image agrees with the range image (Shim & Lee 1995, section VI).
//!
//! Range values R count tenths of a millimetre and lie between 7000 and 8000, the larger
//! the nearer: `R = 7500 + 10 (z - z_mid)`, with `z_mid` the middle of the range image's
//! extent in z. A node that only one of two images has is off by its full value.

use range_image::RangeImage;

/// Peak of the signal in the ratios per region.
pub const PEAK: f64 = 8000.0;

/// Agreement of two images of the same grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// `10 log10(sum R^2 / sum (R - R')^2)` over the whole image, decibels; infinite
    /// when both agree to the last bit.
    pub snr_db: f64,
    /// Nodes of the range image outside every face.
    pub lost_nodes: usize,
    /// Nodes inside a face that the range image lacks.
    pub invented_nodes: usize,
}

/// The scale from z to R.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeScale {
    /// z at which R is 7500, millimetres.
    pub z_mid_mm: f64,
}

impl RangeScale {
    /// The scale of a range image; `None` when every node is masked.
    #[must_use]
    pub fn of(image: &RangeImage) -> Option<Self> {
        let (low, high) = image.z_extent_mm()?;
        Some(Self {
            z_mid_mm: low + (high - low) / 2.0,
        })
    }

    /// R of a height.
    #[must_use]
    pub fn range(self, z_mm: f64) -> f64 {
        7500.0 + 10.0 * (z_mm - self.z_mid_mm)
    }

    /// The height at which R is 0: where Naik & Jain's rectangle has its background.
    #[must_use]
    pub fn background_mm(self) -> f64 {
        self.z_mid_mm - 750.0
    }
}

/// Compares a restored image with the range image it was made from.
///
/// # Panics
/// When the grids differ.
#[must_use]
pub fn compare(image: &RangeImage, restored: &RangeImage) -> Metrics {
    assert_eq!(
        (image.columns(), image.rows(), image.origin()),
        (restored.columns(), restored.rows(), restored.origin()),
        "images of different grids"
    );
    let scale = RangeScale::of(image).unwrap_or(RangeScale { z_mid_mm: 0.0 });
    let (mut signal, mut error, mut lost_nodes, mut invented_nodes) = (0.0, 0.0, 0, 0);
    for (&z, &z_restored) in image.raw_z_mm().iter().zip(restored.raw_z_mm()) {
        let off = match (z.is_nan(), z_restored.is_nan()) {
            (true, true) => 0.0,
            (false, true) => {
                lost_nodes += 1;
                scale.range(z)
            }
            (true, false) => {
                invented_nodes += 1;
                scale.range(z_restored)
            }
            (false, false) => 10.0 * (z - z_restored),
        };
        if !z.is_nan() {
            signal += scale.range(z) * scale.range(z);
        }
        error += off * off;
    }
    Metrics {
        snr_db: decibels(signal, error),
        lost_nodes,
        invented_nodes,
    }
}

/// Peak signal-to-noise ratio for a root mean square residual in millimetres, decibels;
/// infinite for 0.
#[must_use]
pub fn psnr_db(rms_mm: f64) -> f64 {
    decibels(PEAK * PEAK, 100.0 * rms_mm * rms_mm)
}

fn decibels(signal: f64, error: f64) -> f64 {
    if error == 0.0 {
        f64::INFINITY
    } else {
        10.0 * libm::log10(signal / error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::Lattice;

    #[test]
    fn ratios_match_hand_computation() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 2, 2);
        let mut restored = image.clone();
        image.set_z_mm(0, 0, Some(-10.0));
        image.set_z_mm(0, 1, Some(10.0));
        restored.set_z_mm(0, 0, Some(-9.0));
        restored.set_z_mm(1, 1, Some(5.0));
        let metrics = compare(&image, &restored);
        assert_eq!((metrics.lost_nodes, metrics.invented_nodes), (1, 1));
        // R of the image: 7400 and 7600; errors 10, 7600 and 7550.
        let (signal, error): (f64, f64) = (
            7400.0 * 7400.0 + 7600.0 * 7600.0,
            100.0 + 7600.0 * 7600.0 + 7550.0 * 7550.0,
        );
        assert!((metrics.snr_db - 10.0 * libm::log10(signal / error)).abs() < 1e-12);
        assert_eq!(compare(&image, &image).snr_db, f64::INFINITY);
    }

    #[test]
    fn one_count_of_residual_is_78_decibels() {
        assert!((psnr_db(0.1) - 20.0 * libm::log10(8000.0)).abs() < 1e-12);
    }
}
