//! Which regions are slanting strips along the edge of another: chamfers, fillets, countersinks.

use std::collections::BTreeMap;

use range_image::RangeImage;

use super::bow::{Part, is_scrap};
use super::contact::Contact;
use crate::regions::{OUTSIDE, Regions};

/// A region that slants less than this is a floor, radians: 12 degrees.
const LEAST_SLOPE_RAD: f64 = 0.21;
/// Of the border of a strip so much at least is without a step, against one other region.
const LEAST_SHARE: f64 = 0.2;

/// Whether a region slants as strips do.
pub(super) fn slants(regions: &Regions, region: u16) -> bool {
    leans(regions, region, LEAST_SLOPE_RAD)
}

/// Whether a region slants by more than an angle.
pub(super) fn leans(regions: &Regions, region: u16, least_rad: f64) -> bool {
    // Of narrow strips few nodes have others of the strip on the same side: those nearer to a foot.
    // Where a plane lies on the samples it tells better.
    regions.surface(region).is_some_and(|surface| {
        let tilt_rad = match surface.is_plane {
            true => surface.plane.tilt_rad(&nalgebra::Vector3::z()),
            false => 0.0,
        };
        surface.slope_rad.max(tilt_rad) > least_rad
    })
}

/// For each region the floor that it is a strip of, if it is one, and whether it falls from it. What
/// comes back to where it began is none.
pub(super) fn hosts(
    image: &RangeImage,
    regions: &Regions,
    contacts: &BTreeMap<(u16, u16), Contact>,
    bows: &[Option<Part>],
) -> Vec<Option<(u16, bool)>> {
    let mean = mean_heights(image, regions);
    (0..regions.regions.len())
        .map(|index| {
            let own = u16::try_from(index).ok()?;
            if let Some(part) = bows[index] {
                // What bows together is of one floor.
                return (part.of != own).then_some((part.of, false));
            }
            if !slants(regions, own) {
                return None;
            }
            let beside = contacts.range((own, 0)..=(own, u16::MAX));
            let all: usize = beside.clone().map(|(_, contact)| contact.all()).sum();
            let is_whole = |other: u16| match bows[usize::from(other)] {
                Some(_) => is_scrap(regions, own, other),
                None => !slants(regions, other),
            };
            beside
                .filter(|((_, other), _)| *other != OUTSIDE && is_whole(*other))
                .filter(|(_, c)| c.level as f64 >= LEAST_SHARE * all as f64)
                .max_by_key(|((_, other), c)| {
                    let is_scrap = bows[usize::from(*other)].is_some();
                    (is_scrap, c.level, std::cmp::Reverse(*other))
                })
                .map(|((_, other), _)| {
                    let host = bows[usize::from(*other)].map_or(*other, |part| part.of);
                    (host, mean[index] < mean[usize::from(*other)])
                })
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
