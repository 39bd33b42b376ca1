//! The paper's road from normals to regions (Shim & Lee 1995, section II.2): squared-error
//! clustering of six features, connected components, merging across borders that are no creases.

mod cluster;
mod features;
mod meeting;
mod regrow;

use crate::components::{Border, depths, label_components, sizes};
use crate::merge::merge;
use crate::normals;
use crate::scene::{FIT_REACH, NONE, Scene};
use crate::settings::SegmentSettings;
use cluster::cluster;
use features::patterns;
use meeting::strength;
use range_image::{Cancelled, Monitor};
use regrow::regrow;

/// Of so many nodes of a region one must lie deep in it, or it is a sliver.
const LEAST_DEEP: usize = 8;
/// Mixed normals make clusters along creases up to four nodes wide; these have no node so deep.
const SLIM: u8 = 2;

/// Labels of the regions, and the number of connected pieces before any merging.
pub(crate) fn divide(
    scene: &Scene<'_>,
    settings: &SegmentSettings,
    monitor: &dyn Monitor,
) -> Result<(Vec<u32>, usize), Cancelled> {
    let (mut labels, pieces) = clusters(scene, settings, monitor)?;
    monitor.progress(0.45);
    let minimum = settings.fewest_nodes(scene.grid.pitch_mm);
    dissolve_slivers(scene, &mut labels, minimum, Border::Neighbours);
    regrow(scene, &mut labels, monitor)?;
    monitor.progress(0.65);
    merge_by(scene, &mut labels, &[FIT_REACH], monitor)?;
    monitor.progress(0.8);
    // What is slim even now is what mixed normals have left along creases and outlines.
    dissolve_slivers(scene, &mut labels, minimum, Border::All);
    regrow(scene, &mut labels, monitor)?;
    // With borders nearer their places, shorter fits can be trusted too. They follow surfaces
    // that bend away sharply, as towards the outline of something round.
    merge_by(scene, &mut labels, &[FIT_REACH, 4], monitor)?;
    dissolve_slivers(scene, &mut labels, minimum, Border::All);
    regrow(scene, &mut labels, monitor)?;
    Ok((labels, pieces))
}

fn merge_by(
    scene: &Scene<'_>,
    labels: &mut [u32],
    reaches: &[usize],
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let strength = |labels: &[u32], border: &_, _| strength(scene, labels, border, reaches);
    merge(scene, labels, strength, monitor)
}

/// Labels of the connected pieces of clusters, and their number.
fn clusters(
    scene: &Scene<'_>,
    settings: &SegmentSettings,
    monitor: &dyn Monitor,
) -> Result<(Vec<u32>, usize), Cancelled> {
    let grid = &scene.grid;
    let normals = normals::of_grid(grid, None);
    monitor.check()?;
    monitor.progress(0.2);
    let nodes: Vec<usize> = (0..grid.nodes())
        .filter(|&n| normals.of_node(n).is_some())
        .collect();
    let patterns = patterns(scene, &normals, &nodes);
    monitor.check()?;
    let nearest = cluster(&patterns, settings.clusters, settings.seed, monitor)?;
    let mut of_node = vec![None; grid.nodes()];
    for (&node, cluster) in nodes.iter().zip(nearest) {
        of_node[node] = Some(cluster);
    }
    let mut labels = vec![NONE; grid.nodes()];
    let next = label_components(grid, &scene.links, |n| of_node[n], &mut labels, 1);
    Ok((labels, next as usize - 1))
}

/// Takes the label from pieces that are small, or hardly anywhere as deep as [`SLIM`] nodes
/// from a border, so that their nodes go to a neighbour.
fn dissolve_slivers(scene: &Scene<'_>, labels: &mut [u32], minimum_nodes: usize, border: Border) {
    let depths = depths(scene, labels, SLIM, border);
    let sizes = sizes(labels);
    let mut deep = vec![0_usize; sizes.len()];
    for (&label, depth_here) in labels.iter().zip(depths) {
        deep[label as usize] += usize::from(depth_here >= SLIM);
    }
    let kept: Vec<bool> = sizes
        .iter()
        .zip(deep)
        .map(|(&size, deep)| size >= minimum_nodes && deep * LEAST_DEEP >= size)
        .collect();
    for label in labels {
        if !kept[*label as usize] {
            *label = NONE;
        }
    }
}
