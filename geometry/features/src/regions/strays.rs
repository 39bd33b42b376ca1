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
    let mut any = flats(image, labels, surfaces, noise_mm);
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

/// Of a region that is no plane, at least this share lies on one that is parallel to the largest ...
const FLAT_SHARE: f64 = 0.25;
/// ... while the rest slants by more than this, rise over run: 15 degrees.
const SLANT: f64 = 0.27;
/// And the share itself by less: 8 degrees.
const LEVEL: f64 = 0.14;
/// Half of it lies within this share of the heights that it was chosen by, about its median: of a face
/// with rounded edges within a tenth; of the middle of a groove, which is as level, within 0.22.
const FLAT: f64 = 0.16;

/// Unlabels what slants in regions that are a flat face and its chamfer in one.
fn flats(image: &RangeImage, labels: &mut [u16], surfaces: &[Surface], noise_mm: f64) -> bool {
    let rows = image.rows();
    let largest = |is_one: &dyn Fn(&&Surface) -> bool| {
        let own = surfaces.iter().filter(is_one);
        own.max_by_key(|s| s.nodes).map(|s| s.plane)
    };
    // The only face of a part may be the one that has something in it.
    let reference = largest(&|s| s.is_plane).or_else(|| largest(&|s| s.plane.share >= PLANE_SHARE));
    let Some(reference) = reference else {
        return false;
    };
    let window = (2.0 * DEVIATIONS * noise_mm).max(2.0 * PITCHES * image.pitch_mm());
    let mut heights: Vec<Vec<(f64, usize)>> = vec![Vec::new(); surfaces.len()];
    for (node, label) in labels.iter().enumerate() {
        let Some(index) = usize::from(*label)
            .checked_sub(1)
            .filter(|_| *label != NONE)
        else {
            continue;
        };
        let Some(surface) = surfaces.get(index) else {
            continue;
        };
        if surface.is_plane || (surface.plane.share >= PLANE_SHARE && surface.lies_flat(noise_mm)) {
            continue;
        }
        let (column, row) = (node / rows, node % rows);
        if let Some(z_mm) = image.z_mm(column, row) {
            let off = z_mm - reference.z_mm(image.x_mm(column), image.y_mm(row));
            heights[index].push((off, node));
        }
    }
    let mut any = false;
    for own in heights.iter_mut().filter(|own| !own.is_empty()) {
        own.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut first, mut best) = (0, (0, 0));
        for last in 0..own.len() {
            while own[last].0 - own[first].0 > window {
                first += 1;
            }
            if last + 1 - first > best.1 - best.0 {
                best = (first, last + 1);
            }
        }
        if ((best.1 - best.0) as f64) < FLAT_SHARE * own.len() as f64 {
            continue;
        }
        let rest = || own[..best.0].iter().chain(&own[best.1..]);
        let mut slopes: Vec<f64> = rest()
            .filter_map(|(_, node)| slope(image, labels, *node))
            .collect();
        let flat = own[best.0..best.1].iter();
        let mut level: Vec<f64> = flat
            .filter_map(|(_, node)| slope(image, labels, *node))
            .collect();
        let is_level = crate::field::median(&mut level).is_some_and(|slope| slope < LEVEL)
            && half_within(&own[best.0..best.1]).is_some_and(|half| half < FLAT * window);
        if is_level && crate::field::median(&mut slopes).is_some_and(|slope| slope > SLANT) {
            let gone: Vec<usize> = rest().map(|(_, node)| *node).collect();
            for node in gone {
                labels[node] = NONE;
                any = true;
            }
        }
    }
    any
}

/// How far half of the heights stray from their median at most.
fn half_within(own: &[(f64, usize)]) -> Option<f64> {
    let mut heights: Vec<f64> = own.iter().map(|(off, _)| *off).collect();
    let middle = crate::field::median(&mut heights)?;
    let mut offs: Vec<f64> = heights.iter().map(|off| (off - middle).abs()).collect();
    crate::field::median(&mut offs)
}

/// Slope at a node, over two nodes of its region to each side.
fn slope(image: &RangeImage, labels: &[u16], node: usize) -> Option<f64> {
    let rows = image.rows();
    let z = image.raw_z_mm();
    let along = |step: usize| {
        let (low, high) = (node.checked_sub(step)?, node + step);
        let same = high < z.len() && labels[low] == labels[node] && labels[high] == labels[node];
        let run = 2.0
            * image.pitch_mm()
            * if step >= rows {
                (step / rows) as f64
            } else {
                step as f64
            };
        let rise = same.then(|| (z[high] - z[low]) / run)?;
        (!rise.is_nan()).then_some(rise)
    };
    let (a, b) = (along(rows)?, along(1)?);
    Some((a * a + b * b).sqrt())
}
