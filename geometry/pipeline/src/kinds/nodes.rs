//! The nodes that tell of a region's surface.

use nalgebra::Vector3;
use range_image::{NodeQuality, RangeImage, RegionMap};
use shapes::{Sample, spread};

use super::bearing::Bearing;
use crate::neighbourhood::depth;

/// Distances from a region's border, in nodes, from which on nodes are taken: those at the
/// border may rest on samples of both sides. Less where too few are left.
const FROM_BORDER: [u8; 3] = [2, 1, 0];
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

/// The nodes of each region, in the order of their labels.
pub(super) fn of_regions(image: &RangeImage, regions: &RegionMap) -> Vec<Bearing> {
    let mut nodes: Vec<Vec<(usize, usize)>> = vec![Vec::new(); usize::from(regions.regions())];
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let label = usize::from(regions.label(column, row));
            if let Some(own) = label.checked_sub(1).and_then(|k| nodes.get_mut(k)) {
                own.push((column, row));
            }
        }
    }
    let each = nodes.iter().map(|nodes| bearing(image, regions, nodes));
    each.collect()
}

/// The nodes of a region that tell of its surface, and over how many of them noise is alike.
fn bearing(image: &RangeImage, regions: &RegionMap, nodes: &[(usize, usize)]) -> Bearing {
    let inner = |far: u8| {
        let within = |&&(column, row): &&(usize, usize)| depth(regions, column, row) >= far;
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
    let few = taken.len().clamp(1, MOST);
    let area = (rests_on / per_node * few as f64 / taken.len().max(1) as f64).max(1.0);
    let samples = spread(taken.len(), MOST).filter_map(|index| {
        let (column, row) = taken[index];
        let z_mm = image.z_mm(column, row)?;
        Some(Sample {
            point_mm: Vector3::new(image.x_mm(column), image.y_mm(row), z_mm),
            ray: Vector3::z(),
            sigma_mm,
        })
    });
    Bearing {
        samples: samples.collect(),
        area,
        ..Bearing::default()
    }
}
