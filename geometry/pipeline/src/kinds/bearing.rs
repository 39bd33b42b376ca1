//! Which samples a region's surface is told by.

use std::collections::BTreeMap;

use range_image::{RangeImage, RegionMap};
use shapes::{Evidence, Fit, Sample, Shape, decide};

use super::samples::OnRegion;
use crate::neighbourhood::{DEEPEST, depth};

/// Samples that are enough to decide by; where there are fewer away from the border, those
/// nearer to it are taken, too.
const ENOUGH: usize = 200;
/// Standard errors by which the samples beside a neighbour may be off the surface in their mean.
const AGREE: f64 = 2.0;
/// Samples farther off than so many deviations are strays, and tell nothing of the mean.
const STRAY: f64 = 4.0;
/// Deviations by which more than half of these must be off the neighbour's shape.
const APART: f64 = 3.0;
/// How much less sure the surface is at its border than in its middle, in variance.
const AT_BORDER: f64 = 4.0;

/// What a region's surface is decided by.
#[derive(Debug, Default)]
pub(crate) struct Bearing {
    /// Samples well within.
    pub(crate) samples: Vec<Sample>,
    /// As [`shapes::fit`] has it.
    pub(crate) area: f64,
    /// Samples near the border, those together that lie beside the same neighbour, as deep, with
    /// its label. They may be the neighbour's.
    pub(crate) beside: Vec<(u16, Vec<Sample>)>,
}

impl Bearing {
    /// The verdict by the samples within.
    pub(super) fn decide(&self) -> Evidence {
        decide(&self.samples, self.area)
    }

    /// A shape's numbers by the samples beside neighbours as well, where they agree: beside what
    /// is of no region, and beside shapes that they are off. `shapes` are those of all regions, in
    /// the order of their labels. Where a surface goes over into the next smoothly, no sample tells
    /// which of both it is of.
    pub(super) fn refine(&self, fit: &Fit, shapes: &[Option<Shape>]) -> Option<Fit> {
        let mut samples = self.samples.clone();
        for (neighbour, beside) in &self.beside {
            let is_apart = match usize::from(*neighbour).checked_sub(1) {
                None => true,
                Some(other) => match shapes.get(other) {
                    Some(Some(shape)) => is_off(shape, beside),
                    _ => false,
                },
            };
            if is_apart && agree(fit, beside) {
                samples.extend(beside);
            }
        }
        if samples.len() == self.samples.len() {
            return None;
        }
        fit.again(&samples, self.area)
    }
}

/// Whether samples lie off a shape, more than half of them.
fn is_off(shape: &Shape, samples: &[Sample]) -> bool {
    let is_off =
        |sample: &&Sample| shape.distance_mm(&sample.point_mm).abs() > APART * sample.sigma_mm;
    2 * samples.iter().filter(is_off).count() > samples.len()
}

/// Whether samples lie about a surface, neither above nor below in their mean.
fn agree(fit: &Fit, samples: &[Sample]) -> bool {
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0_f64);
    for off in fit.offs(samples).filter(|off| off.abs() <= STRAY) {
        sum += off;
        squares += off * off;
        count += 1.0;
    }
    let sure = AT_BORDER * fit.shape.family().freedom() as f64 / fit.held.max(1) as f64;
    let deviation = (squares / count).sqrt();
    count > 1.0 && (sum / count).abs() <= AGREE * deviation * (1.0 / count + sure).sqrt()
}

/// The samples of each region, in the order of their labels.
pub(super) fn of_samples(
    image: &RangeImage,
    regions: &RegionMap,
    samples: &[OnRegion],
) -> Vec<Bearing> {
    let depths = usize::from(DEEPEST) + 1;
    let mut by_depth = vec![vec![Vec::new(); depths]; usize::from(regions.regions())];
    for on in samples {
        let [column, row] = on.nearest(image);
        let label = usize::from(regions.label(column, row));
        if let Some(of_region) = label.checked_sub(1).and_then(|own| by_depth.get_mut(own)) {
            of_region[usize::from(depth_of(regions, on, label))].push(on);
        }
    }
    let bearing = |by_depth: Vec<Vec<&OnRegion>>| {
        let mut bearing = Bearing {
            area: 1.0,
            ..Bearing::default()
        };
        let mut beside: BTreeMap<(usize, u16), Vec<Sample>> = BTreeMap::new();
        // From the innermost on.
        for (depth, ring) in by_depth.into_iter().enumerate().rev() {
            if bearing.samples.len() < ENOUGH {
                bearing.samples.extend(ring.iter().map(|on| on.sample));
                continue;
            }
            for on in ring {
                let [column, row] = on.nearest(image);
                let neighbour = neighbour(regions, column, row);
                let group = beside.entry((depth, neighbour)).or_default();
                group.push(on.sample);
            }
        }
        let beside = beside.into_iter();
        bearing
            .beside
            .extend(beside.map(|((_, neighbour), own)| (neighbour, own)));
        bearing
    };
    by_depth.into_iter().map(bearing).collect()
}

/// How far the nodes around a sample lie from the border of its region, as [`depth`] has it.
fn depth_of(regions: &RegionMap, on: &OnRegion, label: usize) -> u8 {
    let [c, r] = on.cell.map(|index| index as usize);
    let corners = [(c, r), (c + 1, r), (c, r + 1), (c + 1, r + 1)];
    let depth = |(c, r)| {
        let is_own = usize::from(regions.label(c, r)) == label;
        if is_own { depth(regions, c, r) } else { 0 }
    };
    corners.into_iter().map(depth).min().unwrap_or(0)
}

/// The label nearest to a node that is not its own.
fn neighbour(regions: &RegionMap, column: usize, row: usize) -> u16 {
    let own = regions.label(column, row);
    for far in 1..=usize::from(DEEPEST) {
        for c in column.saturating_sub(far)..=column + far {
            for r in row.saturating_sub(far)..=row + far {
                let label = regions.label(c, r);
                if label != own {
                    return label;
                }
            }
        }
    }
    own
}
