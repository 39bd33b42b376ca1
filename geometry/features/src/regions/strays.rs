//! Nodes that a plane does not explain, taken out of its region.

use range_image::RangeImage;

use super::NONE;
use super::surface::Surface;

/// A plane holds this share of its region at least, else that is a free form.
const PLANE_SHARE: f64 = 0.6;
/// Nodes further off than so many deviations of single samples, and this share of a pitch, stray.
const DEVIATIONS: f64 = 3.0;
const PITCHES: f64 = 0.25;

/// Unlabels the nodes of planes that lie off them: chamfers and roundings that were taken for parts
/// of the faces beside them. Says whether there were some.
pub(super) fn unlabel(
    image: &RangeImage,
    labels: &mut [u16],
    surfaces: &[Surface],
    noise_mm: f64,
) -> bool {
    let rows = image.rows();
    let within = (DEVIATIONS * noise_mm).max(PITCHES * image.pitch_mm());
    let mut any = false;
    for (node, label) in labels.iter_mut().enumerate() {
        let index = usize::from(*label);
        let Some(surface) = (*label != NONE && index > 0).then(|| surfaces.get(index - 1)) else {
            continue;
        };
        let Some(surface) =
            surface.filter(|s| s.plane.share >= PLANE_SHARE && s.lies_flat(noise_mm))
        else {
            continue;
        };
        let (column, row) = (node / rows, node % rows);
        let off = image.z_mm(column, row).map(|z_mm| {
            let plane = surface.plane.z_mm(image.x_mm(column), image.y_mm(row));
            (z_mm - plane).abs()
        });
        if off.is_some_and(|off| off > within) {
            *label = NONE;
            any = true;
        }
    }
    any
}
