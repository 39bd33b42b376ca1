//! What kind of surface each region is.

use core::num::NonZeroU16;

use nalgebra::Vector3;
use range_image::{Cancelled, Monitor, NodeQuality, RangeImage, RegionMap};
use rayon::prelude::*;
use shapes::{Evidence, Sample, decide};

/// Distances from a region's border, in nodes, from which on nodes are taken: those at the
/// border may rest on samples of both sides. Less where too few are left.
const FROM_BORDER: [usize; 3] = [2, 1, 0];
/// Nodes that are enough to decide by.
const ENOUGH: usize = 60;
/// Most nodes that are looked at, spread over the region: what noise neighbours share makes
/// more of them tell no more.
const MOST: usize = 1000;
/// Share of a node's inliers that its z rests on.
const RESTS_ON: f64 = 0.8;
/// Mean distance from a place to the nearest of samples, one per unit area.
const NEAREST: f64 = 0.45;
/// Noise where an image tells none, of its pitch.
const UNTOLD: f64 = 1e-3;

/// A region's kind of surface.
#[derive(Debug, Clone)]
pub struct RegionKind {
    /// The region.
    pub label: NonZeroU16,
    /// The verdict and what it rests on. Distances of nodes, not of samples.
    pub evidence: Evidence,
}

/// Decides for each region, in the order of their labels.
///
/// # Errors
/// Cancelled.
pub fn kinds(
    image: &RangeImage,
    regions: &RegionMap,
    monitor: &dyn Monitor,
) -> Result<Vec<RegionKind>, Cancelled> {
    let mut nodes: Vec<Vec<(usize, usize)>> = vec![Vec::new(); usize::from(regions.regions())];
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let label = usize::from(regions.label(column, row));
            if let Some(own) = label.checked_sub(1).and_then(|k| nodes.get_mut(k)) {
                own.push((column, row));
            }
        }
    }
    let labels: Vec<NonZeroU16> = (1..=regions.regions())
        .filter_map(NonZeroU16::new)
        .collect();
    let decided = nodes.par_iter().zip(labels).map(|(nodes, label)| {
        monitor.check()?;
        let (samples, area) = samples(image, regions, nodes);
        let evidence = decide(&samples, area);
        Ok(RegionKind { label, evidence })
    });
    decided.collect()
}

/// The nodes of a region that tell of its surface, and over how many of them noise is alike.
fn samples(
    image: &RangeImage,
    regions: &RegionMap,
    nodes: &[(usize, usize)],
) -> (Vec<Sample>, f64) {
    let inner = |far: usize| {
        let within = |&&(column, row): &&(usize, usize)| {
            let label = regions.label(column, row);
            let columns = column.checked_sub(far).map(|first| first..=column + far);
            let rows = row.checked_sub(far).map(|first| first..=row + far);
            columns.zip(rows).is_some_and(|(columns, rows)| {
                columns.clone().all(|c| {
                    rows.clone().all(|r| {
                        c < image.columns() && r < image.rows() && regions.label(c, r) == label
                    })
                })
            })
        };
        nodes.iter().filter(within).copied().collect::<Vec<_>>()
    };
    let mut taken = Vec::new();
    for far in FROM_BORDER {
        taken = inner(far);
        if taken.len() >= ENOUGH {
            break;
        }
    }
    let quality =
        |&(column, row): &(usize, usize)| image.quality(column, row).filter(|q| q.inliers > 0);
    let known: Vec<NodeQuality> = taken.iter().filter_map(quality).collect();
    let middle = |value: &dyn Fn(&NodeQuality) -> f64| {
        let mut values: Vec<f64> = known.iter().map(value).collect();
        let middle = values.len() / 2;
        (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
    };
    let rests_on = middle(&|q| RESTS_ON * f64::from(q.inliers))
        .unwrap_or(1.0)
        .max(1.0);
    let deviation_mm = middle(&|q| f64::from(q.scale_mm)).unwrap_or(0.0);
    let sigma_mm = (deviation_mm / rests_on.sqrt()).max(UNTOLD * image.pitch_mm());
    let spacing_mm = middle(&|q| f64::from(q.nearest_mm)).map(|nearest| nearest / NEAREST);
    let per_node = spacing_mm
        .filter(|spacing| *spacing > 0.0)
        .map_or(1.0, |spacing| (image.pitch_mm() / spacing).powi(2).min(1.0));
    let stride = taken.len().div_ceil(MOST).max(1);
    let area = (rests_on / per_node / stride as f64).max(1.0);
    let samples = taken.iter().step_by(stride);
    let samples = samples.filter_map(|&(column, row)| {
        let z_mm = image.z_mm(column, row)?;
        Some(Sample {
            point_mm: Vector3::new(image.x_mm(column), image.y_mm(row), z_mm),
            sigma_mm: sigma_mm / steepness(image, regions, column, row),
        })
    });
    (samples.collect(), area)
}

/// How much longer a step on the surface is than its shadow on the x-y plane, across the
/// slope.
fn steepness(image: &RangeImage, regions: &RegionMap, column: usize, row: usize) -> f64 {
    let label = regions.label(column, row);
    let z_mm = |c: Option<usize>, r: Option<usize>| {
        let (c, r) = (c?, r?);
        let own = c < image.columns() && r < image.rows() && regions.label(c, r) == label;
        if own { image.z_mm(c, r) } else { None }
    };
    let rise = |low: Option<f64>, high: Option<f64>| match (low, high) {
        (Some(low), Some(high)) => (high - low) / (2.0 * image.pitch_mm()),
        _ => 0.0,
    };
    let along = rise(
        z_mm(column.checked_sub(1), Some(row)),
        z_mm(Some(column + 1), Some(row)),
    );
    let up = rise(
        z_mm(Some(column), row.checked_sub(1)),
        z_mm(Some(column), Some(row + 1)),
    );
    (1.0 + along * along + up * up).sqrt()
}
