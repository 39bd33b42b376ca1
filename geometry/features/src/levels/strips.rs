//! Which regions are slanting strips along the edge of another: chamfers, fillets, countersinks.

use std::collections::BTreeMap;

use range_image::RangeImage;

use super::contact::Contact;
use crate::regions::{OUTSIDE, Region, Regions};

/// A region that slants less than this is a floor, radians: 12 degrees.
const LEAST_SLOPE_RAD: f64 = 0.21;
/// Of the border of a strip so much at least is without a step, against one other region.
const LEAST_SHARE: f64 = 0.2;

/// For each region the floor that it is a strip of, if it is one, and whether it falls from it.
pub(super) fn hosts(
    image: &RangeImage,
    regions: &Regions,
    contacts: &BTreeMap<(u16, u16), Contact>,
) -> Vec<Option<(u16, bool)>> {
    // Of narrow strips few nodes have others of the strip on the same side: those nearer to a foot.
    // Where a plane lies on the samples it tells better.
    let slants = |index: usize| match &regions.regions[index] {
        Region::Part(surface) => {
            let tilt_rad = match surface.is_plane {
                true => surface.plane.tilt_rad(&nalgebra::Vector3::z()),
                false => 0.0,
            };
            surface.slope_rad.max(tilt_rad) > LEAST_SLOPE_RAD
        }
        _ => false,
    };
    let mean = mean_heights(image, regions);
    (0..regions.regions.len())
        .map(|index| {
            if !slants(index) {
                return None;
            }
            let own = u16::try_from(index).ok()?;
            let beside = contacts.range((own, 0)..=(own, u16::MAX));
            let all: usize = beside.clone().map(|(_, contact)| contact.all()).sum();
            beside
                .filter(|((_, other), _)| *other != OUTSIDE && !slants(usize::from(*other)))
                .filter(|(_, c)| c.level as f64 >= LEAST_SHARE * all as f64)
                .max_by_key(|((_, other), c)| (c.level, std::cmp::Reverse(*other)))
                .map(|((_, other), _)| (*other, mean[index] < mean[usize::from(*other)]))
        })
        .collect()
}

fn mean_heights(image: &RangeImage, regions: &Regions) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_u32); regions.regions.len()];
    for (label, z_mm) in regions.labels.iter().zip(image.raw_z_mm()) {
        if !z_mm.is_nan() {
            let sum = &mut sums[usize::from(*label)];
            sum.0 += z_mm;
            sum.1 += 1;
        }
    }
    sums.iter()
        .map(|(sum, count)| sum / f64::from((*count).max(1)))
        .collect()
}
