//! The stages in their order.

use crate::cluster::cluster;
use crate::components::{Border, depths, label_components, sizes};
use crate::crease::creased;
use crate::features::patterns;
use crate::fill::filled;
use crate::grid::{Grid, Links};
use crate::merge::merge;
use crate::noise::noise_mm;
use crate::normals::{self, Normals};
use crate::regrow::{redraw_borders, regrow};
use crate::scene::{FIT_REACH, NONE, Scene};
use crate::settings::{Method, SegmentSettings, SettingsError};
use range_image::{Cancelled, Monitor, RangeImage, RegionMap};

/// Limit of |z|, millimetres: beyond it rounding would show in the results.
pub const MAX_Z_MM: f64 = 1e9;
/// A jump below so many deviations of the noise may be noise.
const STEP_NOISES: f64 = 6.0;

/// Of so many nodes of a region one must lie deep in it, or it is a sliver.
const LEAST_DEEP: usize = 8;

/// Why an image cannot be segmented.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SegmentError {
    /// A setting lies outside its limits.
    #[error("segmentation settings: {0}")]
    Settings(#[from] SettingsError),
    /// The image's pitch is no length.
    #[error("the range image has a pitch of {0} mm; it must be positive and finite")]
    Pitch(f64),
    /// A node lies out of reach.
    #[error("z is {z_mm} mm at column {column}, row {row}; it must be within 1e9 mm of zero")]
    OutOfRange {
        /// Column of the node.
        column: usize,
        /// Row of the node.
        row: usize,
        /// Its z, millimetres.
        z_mm: f64,
    },
    /// The image has more nodes than can be numbered.
    #[error("the range image has {0} nodes; at most 4294967295 are possible")]
    TooLarge(usize),
    /// The caller gave up.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What was measured on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Standard deviation of z about the surface, measured in the image, millimetres.
    pub noise_mm: f64,
    /// Jump that counted as a step, square to the surface, millimetres.
    pub step_mm: f64,
    /// Connected pieces of clusters before anything was dissolved or merged.
    pub components: usize,
    /// Pieces left unlabelled because they have too few nodes.
    pub crumbs: usize,
    /// Nodes in these.
    pub crumb_nodes: usize,
}

/// Regions and how they came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Segmentation {
    /// The label of each node.
    pub regions: RegionMap,
    /// What was measured.
    pub report: Report,
}

/// Divides a range image into regions of one surface each; see the [crate].
///
/// Regions are 4-connected without crossing a step. They are numbered by position: in the
/// order in which the columns, each from its lowest node upwards, first meet them.
///
/// # Errors
/// Settings or image out of limits, or cancelled.
pub fn segment(
    image: &RangeImage,
    settings: &SegmentSettings,
    monitor: &dyn Monitor,
) -> Result<RegionMap, SegmentError> {
    Ok(segment_with_report(image, settings, monitor)?.regions)
}

/// As [`segment`], with what was measured on the way.
///
/// # Errors
/// As [`segment`].
pub fn segment_with_report(
    image: &RangeImage,
    settings: &SegmentSettings,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    settings.validate()?;
    check(image)?;
    let measured = Grid::new(image);
    let noise = noise_mm(&measured);
    let working = filled(&measured);
    let grid = Grid {
        z_mm: &working,
        ..measured
    };
    let step_mm = (settings.step_factor * grid.pitch_mm).max(STEP_NOISES * noise);
    let scene = Scene {
        grid,
        links: Links::new(&grid, step_mm),
        noise_mm: noise,
        step_mm,
        crease_rad: settings.crease_angle_rad,
    };
    monitor.progress(0.05);
    let normals = match settings.method {
        Method::ShimLee => normals::of_grid(&grid, None),
        Method::Relief => normals::of_grid(&grid, Some(&scene.links)),
    };
    monitor.check()?;
    monitor.progress(0.2);
    let (mut labels, components) = clusters(&scene, &normals, settings, monitor)?;
    monitor.progress(0.45);
    let minimum = settings.fewest_nodes(grid.pitch_mm);
    let (slim, reaches): (u8, &[usize]) = match settings.method {
        // Mixed normals may have made clusters along creases, up to four nodes wide.
        Method::ShimLee => (2, &[FIT_REACH, 4]),
        Method::Relief => (1, &[FIT_REACH, 4, 3]),
    };
    dissolve_slivers(&scene, &mut labels, minimum, slim, Border::Neighbours);
    regrow(&scene, &mut labels, monitor)?;
    monitor.progress(0.65);
    merge(&scene, &mut labels, &[FIT_REACH], monitor)?;
    monitor.progress(0.8);
    // What is slim even now is what mixed normals have left along creases and outlines.
    dissolve_slivers(&scene, &mut labels, minimum, 2, Border::All);
    regrow(&scene, &mut labels, monitor)?;
    if settings.method == Method::Relief {
        redraw_borders(&scene, &mut labels, monitor)?;
    }
    // With borders nearer their places, shorter fits can be trusted too. They follow surfaces
    // that bend away sharply, as towards the outline of something round.
    merge(&scene, &mut labels, reaches, monitor)?;
    dissolve_slivers(&scene, &mut labels, minimum, 2, Border::All);
    regrow(&scene, &mut labels, monitor)?;
    monitor.progress(0.95);
    let (labels, crumbs, crumb_nodes) = finish(&scene, &measured, &labels, minimum);
    monitor.progress(1.0);
    Ok(Segmentation {
        regions: RegionMap::new(image, labels),
        report: Report {
            noise_mm: noise,
            step_mm,
            components,
            crumbs,
            crumb_nodes,
        },
    })
}

fn check(image: &RangeImage) -> Result<(), SegmentError> {
    let pitch = image.pitch_mm();
    if !(pitch > 0.0 && pitch.is_finite()) {
        return Err(SegmentError::Pitch(pitch));
    }
    let z = image.raw_z_mm();
    if u32::try_from(z.len()).is_err() {
        return Err(SegmentError::TooLarge(z.len()));
    }
    match z.iter().position(|z| z.abs() > MAX_Z_MM) {
        Some(node) => Err(SegmentError::OutOfRange {
            column: node / image.rows(),
            row: node % image.rows(),
            z_mm: z[node],
        }),
        None => Ok(()),
    }
}

/// Labels of the connected pieces of clusters, and their number.
fn clusters(
    scene: &Scene<'_>,
    normals: &Normals,
    settings: &SegmentSettings,
    monitor: &dyn Monitor,
) -> Result<(Vec<u32>, usize), Cancelled> {
    let grid = &scene.grid;
    let aside = match settings.method {
        Method::ShimLee => vec![false; grid.nodes()],
        Method::Relief => creased(scene, normals),
    };
    let nodes: Vec<usize> = (0..grid.nodes())
        .filter(|&n| !aside[n] && normals.of_node(n).is_some())
        .collect();
    let patterns = patterns(scene, normals, &nodes, settings.method);
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

/// Takes the label from pieces that are small, or hardly anywhere as deep as `depth` nodes from
/// a border, so that their nodes go to a neighbour.
fn dissolve_slivers(
    scene: &Scene<'_>,
    labels: &mut [u32],
    minimum_nodes: usize,
    depth: u8,
    border: Border,
) {
    let depths = depths(scene, labels, depth, border);
    let sizes = sizes(labels);
    let mut deep = vec![0_usize; sizes.len()];
    for (&label, depth_here) in labels.iter().zip(depths) {
        deep[label as usize] += usize::from(depth_here >= depth);
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

/// Connected regions of the asked size, at most as many as labels go, the largest first
/// choice; and the number of pieces left out and of their nodes.
fn finish(
    scene: &Scene<'_>,
    measured: &Grid<'_>,
    labels: &[u32],
    minimum_nodes: usize,
) -> (Vec<u16>, usize, usize) {
    let mut pieces = vec![NONE; labels.len()];
    let key = |n: usize| measured.is_valid(n).then(|| labels[n]);
    label_components(measured, &scene.links, key, &mut pieces, 1);
    let sizes = sizes(&pieces);
    let mut order: Vec<usize> = (1..sizes.len()).collect();
    order.sort_by_key(|&p| (core::cmp::Reverse(sizes[p]), p));
    let mut given = vec![0_u16; sizes.len()];
    let (mut crumbs, mut crumb_nodes, mut next) = (0, 0, 1_u16);
    for piece in order {
        if sizes[piece] >= minimum_nodes && next < u16::MAX {
            given[piece] = next;
            next += 1;
        } else {
            crumbs += 1;
            crumb_nodes += sizes[piece];
        }
    }
    let labels = pieces.iter().map(|&p| given[p as usize]).collect();
    (labels, crumbs, crumb_nodes)
}
