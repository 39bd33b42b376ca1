//! The account of a region: how its surfaces meet its nodes, and at what price.

use nurbs::PatchSurface;
use range_image::RangeImage;

use crate::run::{Node, RegionFit};

/// What a surface was given, and what gave it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Freedom {
    /// As [`RegionFit::parameters`].
    pub(crate) parameters: usize,
    /// Whether all faces of the region have them in common.
    pub(crate) is_shared: bool,
    /// As [`RegionFit::independent`].
    pub(crate) independent: usize,
}

/// Adds a face to the account of its region; gives its own root mean square residual.
pub(crate) fn tally(
    fits: &mut Vec<RegionFit>,
    label: u16,
    image: &RangeImage,
    nodes: &[Node],
    (surface, freedom): (&PatchSurface, Freedom),
) -> f64 {
    let (rms_mm, max_mm) = residuals(image, nodes, surface);
    let count = nodes.len() as f64;
    let sum = rms_mm * rms_mm * count;
    match fits.last_mut() {
        Some(fit) if fit.label == label => {
            let before = fit.rms_mm * fit.rms_mm * fit.nodes as f64;
            fit.nodes += nodes.len();
            fit.rms_mm = ((before + sum) / fit.nodes as f64).sqrt();
            fit.max_mm = fit.max_mm.max(max_mm);
            fit.faces += 1;
            fit.patches += surface.patches.len();
            fit.independent += freedom.independent;
            if freedom.is_shared {
                fit.parameters = fit.parameters.max(freedom.parameters);
            } else {
                fit.parameters += freedom.parameters;
            }
        }
        _ => fits.push(RegionFit {
            label,
            nodes: nodes.len(),
            faces: 1,
            patches: surface.patches.len(),
            parameters: freedom.parameters,
            independent: freedom.independent,
            area_mm2: 0.0,
            rms_mm,
            max_mm,
            psnr_db: 0.0,
        }),
    }
    rms_mm
}

/// Root mean square and greatest residual of nodes, millimetres.
pub(crate) fn residuals(image: &RangeImage, nodes: &[Node], surface: &PatchSurface) -> (f64, f64) {
    let (mut sum, mut max_mm) = (0.0, 0.0_f64);
    for n in nodes {
        let off = surface.z(image.x_mm(n.column), image.y_mm(n.row)) - n.z_mm;
        sum += off * off;
        max_mm = max_mm.max(off.abs());
    }
    ((sum / nodes.len() as f64).sqrt(), max_mm)
}
