//! Table 1: one region, fitted in three ways, held against two references.

use anyhow::Result;
use pipeline::Outcome;
use range_image::RangeImage;
use reconstruct::Surface;
use reconstruct::comparison::fit_both_ways;
use reconstruct::metrics::psnr_db;

use crate::true_image::TrueImage;

/// The range image that went in, or what is really there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reference {
    RangeImage,
    Truth,
}

/// Peak signal-to-noise ratios of one region, decibels; by [`Reference`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RegionFigures {
    /// Naik & Jain's way: the background stays in the rectangle.
    pub(crate) naik_db: [f64; 2],
    /// The same spline over the region's extension, trimmed.
    pub(crate) extension_db: [f64; 2],
    /// The surface of the model; NaN where the region gave no face.
    pub(crate) face_db: [f64; 2],
    /// Nodes of the region.
    pub(crate) nodes: usize,
    /// Those of them at which its face is not what is seen.
    pub(crate) astray: usize,
    /// Nodes at which its face is seen but that do not belong to the region.
    pub(crate) missing: usize,
}

/// Root mean square of differences.
#[derive(Debug, Clone, Copy, Default)]
struct MeanSquare {
    sum: f64,
    count: f64,
}

impl MeanSquare {
    fn add(&mut self, off: f64) {
        self.sum += off * off;
        self.count += 1.0;
    }

    fn psnr_db(self) -> f64 {
        if self.count > 0.0 {
            psnr_db((self.sum / self.count).sqrt())
        } else {
            f64::NAN
        }
    }
}

/// Differences from both references.
#[derive(Debug, Clone, Copy, Default)]
struct Both([MeanSquare; 2]);

impl Both {
    fn add(&mut self, z: f64, measured: f64, true_z: Option<f64>) {
        self.0[Reference::RangeImage as usize].add(z - measured);
        if let Some(true_z) = true_z {
            self.0[Reference::Truth as usize].add(z - true_z);
        }
    }

    fn psnr_db(self) -> [f64; 2] {
        self.0.map(MeanSquare::psnr_db)
    }
}

/// Measures the region with this label, which is the given face.
pub(crate) fn figures(
    image: &RangeImage,
    outcome: &Outcome,
    truth: &TrueImage,
    label: u16,
    face: usize,
) -> Result<RegionFigures> {
    let map = &outcome.regions;
    let ways = fit_both_ways(image, map, label)?;
    let mut drawn = outcome.reconstruction.model.faces.iter();
    let surface = drawn
        .find(|face| face.region == label)
        .map(|face| match &face.surface {
            Surface::Patches(patches) => patches,
        });
    let (mut naik, mut extension, mut ours) = (Both::default(), Both::default(), Both::default());
    let (mut nodes, mut on_face) = (0, 0);
    for column in 0..image.columns() {
        for row in (0..image.rows()).filter(|&row| map.label(column, row) == label) {
            let Some(measured) = image.z_mm(column, row) else {
                continue;
            };
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let seen = truth.at(image, column, row);
            let true_z = seen.map(|(z, _)| z);
            naik.add(ways.background.spline.value(x, y), measured, true_z);
            extension.add(ways.extended.spline.value(x, y), measured, true_z);
            if let Some(surface) = surface {
                ours.add(surface.z(x, y), measured, true_z);
            }
            nodes += 1;
            on_face += usize::from(seen.is_some_and(|(_, f)| f == face));
        }
    }
    Ok(RegionFigures {
        naik_db: naik.psnr_db(),
        extension_db: extension.psnr_db(),
        face_db: ours.psnr_db(),
        nodes,
        astray: nodes - on_face,
        missing: truth.nodes_of(face).saturating_sub(on_face),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_are_kept_apart_and_nothing_true_does_not_count() {
        let mut both = Both::default();
        both.add(1.0, 1.1, Some(1.3));
        both.add(2.0, 2.1, None);
        let [measured, truth] = both.psnr_db();
        assert!((measured - psnr_db(0.1)).abs() < 1e-9);
        assert!((truth - psnr_db(0.3)).abs() < 1e-9);
        assert!(MeanSquare::default().psnr_db().is_nan());
    }
}
