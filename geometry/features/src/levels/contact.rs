//! How regions meet: by a step, or without one.

use std::collections::BTreeMap;

use range_image::RangeImage;

use crate::regions::Regions;

/// Which way z goes from one node to its neighbour of another region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Up by a step.
    Rises,
    /// Down by a step.
    Falls,
    /// Neither.
    Level,
}

/// What the border of two regions consists of, in pairs of neighbouring nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Contact {
    /// Pairs where the second region is higher by a step.
    pub(super) rises: usize,
    /// Pairs where it is lower by a step.
    pub(super) falls: usize,
    /// Pairs without a step.
    pub(super) level: usize,
}

impl Contact {
    /// All pairs.
    #[must_use]
    pub(super) fn all(&self) -> usize {
        self.rises + self.falls + self.level
    }
}

/// Contacts of regions, by the pair of their indices, both ways.
pub(super) fn contacts(
    image: &RangeImage,
    regions: &Regions,
    step_mm: f64,
) -> BTreeMap<(u16, u16), Contact> {
    let mut found: BTreeMap<(u16, u16), Contact> = BTreeMap::new();
    for node in 0..regions.labels.len() {
        let own = regions.labels[node];
        for other in regions.neighbours(node) {
            let theirs = regions.labels[other];
            if theirs == own {
                continue;
            }
            let contact = found.entry((own, theirs)).or_default();
            match sense(image, regions, (node, other), step_mm) {
                Sense::Rises => contact.rises += 1,
                Sense::Falls => contact.falls += 1,
                Sense::Level => contact.level += 1,
            }
        }
    }
    found
}

/// Which way z goes from a node to its neighbour. What both surfaces rise by from node to node
/// beside the border is no step.
pub(crate) fn sense(
    image: &RangeImage,
    regions: &Regions,
    (node, other): (usize, usize),
    step_mm: f64,
) -> Sense {
    let (Some(here), Some(there)) = (
        regions.height_mm(image, node),
        regions.height_mm(image, other),
    ) else {
        // What is not seen lies below what is.
        return match regions.height_mm(image, node) {
            None => Sense::Rises,
            Some(_) => Sense::Falls,
        };
    };
    let rise = there - here;
    let behind = run(image, regions, other, node);
    let beyond = run(image, regions, node, other);
    let natural = behind.abs().max(beyond.abs());
    if rise > step_mm + natural {
        Sense::Rises
    } else if rise < -step_mm - natural {
        Sense::Falls
    } else {
        Sense::Level
    }
}

/// What z rises by in the step that goes on from `from` over `at`, within the region of `at`.
fn run(image: &RangeImage, regions: &Regions, from: usize, at: usize) -> f64 {
    let step = at as i64 - from as i64;
    let Ok(next) = usize::try_from(at as i64 + step) else {
        return 0.0;
    };
    let is_row = step.unsigned_abs() == 1;
    let same_line = !is_row || next / regions.rows == at / regions.rows;
    if !same_line || next >= regions.labels.len() || regions.labels[next] != regions.labels[at] {
        return 0.0;
    }
    let z = image.raw_z_mm();
    let rise = z[next] - z[at];
    if rise.is_nan() { 0.0 } else { rise }
}
