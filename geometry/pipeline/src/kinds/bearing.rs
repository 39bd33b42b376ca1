//! Which samples a region's surface is told by.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use range_image::{RangeImage, RegionMap};
use shapes::{Evidence, Fit, Sample, Shape, SweptFit, decide_whole, swept};

use super::joins::{Joining, LEAST_JOINING};
use super::samples::OnRegion;
use crate::neighbourhood::{DEEPEST, depth};

/// Samples that are enough to decide by; where there are fewer away from the border, those
/// nearer to it are taken, too.
const ENOUGH: usize = 200;
/// Share of a region's samples that are enough: the middle of a strip does not tell how that bends.
const SHARE: f64 = 0.5;
/// Standard errors by which the samples beside a neighbour may be off the surface in their mean.
const AGREE: f64 = 2.0;
/// Samples farther off than so many deviations are strays, and tell nothing of the mean.
const STRAY: f64 = 4.0;
/// Deviations by which more than half of these must be off the neighbour's shape.
const APART: f64 = 3.0;
/// How far from a node another region may be for its samples to lie near that, in nodes: borders of
/// smooth joins are off by no more.
const JOINING: usize = 4;
/// How much less sure the surface is at its border than in its middle, in variance.
const AT_BORDER: f64 = 4.0;

/// What a region's surface is decided by.
#[derive(Debug, Default)]
pub(crate) struct Bearing {
    /// Samples well within.
    pub(crate) samples: Vec<Sample>,
    /// As [`shapes::fit`] has it.
    pub(crate) area: f64,
    /// Those of them that lie near no other region.
    pub(crate) far: Vec<Sample>,
    /// Samples near other regions, well within or not.
    pub(crate) joining: Vec<Joining>,
    /// Samples near the border, those together that lie beside the same neighbour, as deep, with
    /// its label. They may be the neighbour's.
    pub(crate) beside: Vec<(u16, Vec<Sample>)>,
}

impl Bearing {
    /// The verdict by the samples within.
    pub(super) fn decide(&self) -> Evidence {
        decide_whole(&self.samples, self.area)
    }

    /// The surface of extrusion or revolution that the samples within speak for, if they do, with a
    /// profile that goes on to the border.
    pub(super) fn swept(&self) -> Option<SweptFit> {
        let found = swept(&self.samples, self.area)?;
        let beside = self.beside.iter().flat_map(|(_, beside)| beside);
        let all: Vec<Sample> = self.samples.iter().chain(beside).copied().collect();
        found.again(&all, self.area)
    }

    /// The samples near the border that are of the shape as well: beside what is of no region, beside
    /// shapes that they are off, and beside free forms whose samples are off the shape; and the
    /// neighbours whose shape goes on from this one, so that no distance tells which of both a sample
    /// is of. `all` are what the regions are decided by, and their shapes, in the order of their
    /// labels.
    pub(super) fn besides(
        &self,
        label: u16,
        fit: &Fit,
        (bearings, shapes): (&[Self], &[Option<Shape>]),
    ) -> (Vec<Sample>, Vec<u16>) {
        let (mut samples, mut smooth) = (Vec::new(), Vec::new());
        for (neighbour, beside) in &self.beside {
            let index = usize::from(*neighbour).checked_sub(1);
            let other = index.map(|k| bearings.get(k).zip(shapes.get(k)));
            let is_apart = match other {
                None => true,
                Some(Some((_, Some(shape)))) if !is_off(shape, beside) => {
                    smooth.push(*neighbour);
                    false
                }
                Some(Some((_, Some(_)))) => true,
                Some(Some((bearing, None))) => {
                    let towards = bearing.joining.iter().filter(|j| j.neighbour == label);
                    let near: Vec<Sample> = towards.map(|joining| joining.sample).collect();
                    near.len() >= LEAST_JOINING && is_off(&fit.shape, &near)
                }
                Some(None) => false,
            };
            if is_apart && agree(fit, beside) {
                samples.extend(beside);
            }
        }
        smooth.sort_unstable();
        smooth.dedup();
        (samples, smooth)
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
        let all: usize = by_depth.iter().map(Vec::len).sum();
        let enough = ENOUGH.max((SHARE * all as f64) as usize);
        let mut bearing = Bearing {
            area: 1.0,
            ..Bearing::default()
        };
        let mut beside: BTreeMap<(usize, u16), Vec<Sample>> = BTreeMap::new();
        // From the innermost on.
        for (depth, ring) in by_depth.into_iter().enumerate().rev() {
            let is_within = bearing.samples.len() < enough;
            for on in ring {
                let [column, row] = on.nearest(image);
                match way(regions, column, row) {
                    Some((neighbour, across)) => bearing.joining.push(Joining {
                        sample: on.sample,
                        neighbour,
                        across,
                        is_within,
                    }),
                    None if is_within => bearing.far.push(on.sample),
                    None => {}
                }
                if is_within {
                    bearing.samples.push(on.sample);
                    continue;
                }
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

/// The region nearest to a node that is not its own, and the way there, no farther than
/// [`JOINING`].
fn way(regions: &RegionMap, column: usize, row: usize) -> Option<(u16, Vector2<f64>)> {
    let own = regions.label(column, row);
    let mut best: Option<(usize, u16, Vector2<f64>)> = None;
    for c in column.saturating_sub(JOINING)..(column + JOINING + 1).min(regions.columns()) {
        for r in row.saturating_sub(JOINING)..(row + JOINING + 1).min(regions.rows()) {
            let label = regions.label(c, r);
            let far = c.abs_diff(column).pow(2) + r.abs_diff(row).pow(2);
            if label != own && label != 0 && best.is_none_or(|(least, ..)| far < least) {
                let way = Vector2::new(c as f64 - column as f64, r as f64 - row as f64);
                best = Some((far, label, way.normalize()));
            }
        }
    }
    best.map(|(_, label, across)| (label, across))
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use range_image::Lattice;

    use super::*;

    fn sample(x: f64, y: f64, z: f64) -> Sample {
        Sample {
            point_mm: Vector3::new(x, y, z),
            ray: Vector3::z(),
            sigma_mm: 0.05,
        }
    }

    /// Whether samples of a level plane beside a free form of this rise are taken for the plane's.
    fn are_taken(rise: f64) -> bool {
        let noise = |k: usize| 0.01 * ((k * 7 % 11) as f64 - 5.0);
        let own = |k: usize| sample(-0.4 * (k % 20) as f64, 0.4 * (k / 20) as f64, noise(k));
        let samples: Vec<Sample> = (0..400).map(own).collect();
        let fit = shapes::fit(shapes::Family::Plane, &samples, 1.0).unwrap();
        let beyond = (0..60).map(|k| {
            let x = 0.4 * (1 + k % 3) as f64;
            Joining {
                sample: sample(x, 0.4 * (k / 3) as f64, rise * x + noise(k)),
                neighbour: 1,
                across: -Vector2::x(),
                is_within: false,
            }
        });
        let free_form = Bearing {
            joining: beyond.collect(),
            ..Bearing::default()
        };
        let plane = Bearing {
            beside: vec![(2, samples[..100].to_vec())],
            ..Bearing::default()
        };
        let shapes = [Some(fit.shape), None];
        let bearings = [plane, free_form];
        let (taken, smooth) = bearings[0].besides(1, &fit, (&bearings, &shapes));
        assert!(smooth.is_empty());
        !taken.is_empty()
    }

    #[test]
    fn a_free_form_is_another_surface_where_its_samples_are_off() {
        assert!(are_taken(1.0));
        // It may go on from the plane.
        assert!(!are_taken(0.05));
    }

    /// How many columns of cells the samples span that a strip of so many columns is decided by.
    fn width_told(columns: usize) -> usize {
        const ROWS: usize = 100;
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, columns + 2, ROWS);
        for node in 0..(columns + 2) * ROWS {
            image.set_z_mm(node / ROWS, node % ROWS, Some(0.0));
        }
        let label = |node: usize| u16::from((1..=columns).contains(&(node / ROWS)));
        let labels = (0..(columns + 2) * ROWS).map(label).collect();
        let regions = RegionMap::new(&image, labels);
        let sample = |column: usize, row: usize| OnRegion {
            cell: [column as u32, row as u32],
            sample: sample(column as f64 + 0.4, row as f64 + 0.4, 0.0),
        };
        let cells = (1..columns).flat_map(|column| (0..ROWS - 1).map(move |row| (column, row)));
        let samples: Vec<OnRegion> = cells.map(|(column, row)| sample(column, row)).collect();
        let bearing = of_samples(&image, &regions, &samples).remove(0);
        let column = |sample: &Sample| sample.point_mm.x as usize;
        let mut told: Vec<usize> = bearing.samples.iter().map(column).collect();
        told.sort_unstable();
        told.dedup();
        told.len()
    }

    #[test]
    fn a_strip_is_told_by_more_than_its_middle() {
        // Of 8 columns of cells the 4 in the middle have more samples than are enough, and less
        // than half of all.
        assert_eq!(width_told(9), 6);
        // Of 23 those away from the border have most.
        assert_eq!(width_told(24), 19);
    }
}
