//! The stages in their order.

use crate::components::{label_components, sizes};
use crate::fill::filled;
use crate::grid::{Grid, Links};
use crate::noise::noise;
use crate::scene::{NONE, Scene};
use crate::settings::{Method, SegmentSettings, SettingsError};
use crate::{relief, shim_lee};
use range_image::{Cancelled, Monitor, RangeImage, RegionMap};

/// Limit of |z|, millimetres: beyond it rounding would show in the results.
pub const MAX_Z_MM: f64 = 1e9;
/// A jump below so many deviations of the noise may be noise.
const STEP_NOISES: f64 = 6.0;

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
    /// Connected pieces before anything was dissolved or merged.
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
/// Regions are 4-connected without crossing a step; narrow faces, whose plane explains the step,
/// are 8-connected. They are numbered by position: in the order in which the columns, each from
/// its lowest node upwards, first meet them.
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
    let noise = noise(image, &measured);
    let working = filled(&measured);
    let grid = Grid {
        z_mm: &working,
        ..measured
    };
    let step_mm = (settings.step_factor * grid.pitch_mm).max(STEP_NOISES * noise.deviation_mm);
    let mut scene = Scene {
        grid,
        links: Links::new(&grid, step_mm),
        noise,
        step_mm,
        crease_rad: settings.crease_angle_rad,
    };
    monitor.progress(0.05);
    let (labels, components) = match settings.method {
        Method::ShimLee => shim_lee::divide(&scene, settings, monitor)?,
        Method::Relief => relief::divide(&mut scene, settings.bent_seeds, monitor)?,
    };
    let minimum = settings.fewest_nodes(grid.pitch_mm);
    monitor.progress(0.95);
    let (labels, crumbs, crumb_nodes) = finish(&scene, &measured, &labels, minimum);
    monitor.progress(1.0);
    Ok(Segmentation {
        regions: RegionMap::new(image, labels),
        report: Report {
            noise_mm: noise.deviation_mm,
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
