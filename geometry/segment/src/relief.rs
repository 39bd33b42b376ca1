//! The default road: surfaces of variable order are grown from the flattest places, compete
//! for the nodes at their borders, and become one region where they join smoothly.

mod border;
mod compete;
mod grow;
mod least_squares;
mod models;
mod piece;
mod revise;
mod strips;
mod surface;
mod windows;

use crate::merge::{Border, merge};
use crate::scene::Scene;
use models::{Models, Planes};
use range_image::{Cancelled, Monitor};

/// Smaller regions, and curved ones, join a neighbour when nothing speaks against it; a plane
/// that is larger only when it is certain.
const SMALL: usize = 400;
/// Steps for every link from which on a border is a step and its links are noise's: where a plane
/// ends, and between free forms, which break into steps where they are steep.
const STEPS_OF_PLANE: usize = 1;
const STEPS: usize = 3;

/// Labels of the regions, and the number of pieces before merging; `bent_seeds` as in
/// [`SegmentSettings`](crate::SegmentSettings).
pub(crate) fn divide(
    scene: &mut Scene<'_>,
    bent_seeds: bool,
    monitor: &dyn Monitor,
) -> Result<(Vec<u32>, usize), Cancelled> {
    let mut pieces = grow::pieces(scene, bent_seeds, monitor)?;
    monitor.progress(0.4);
    compete::spread(scene, &mut pieces, grow::MISS_NOISES);
    revise::dissolve(scene, &mut pieces);
    let grown = pieces.surfaces.len() as u32;
    revise::leftovers(scene, &mut pieces);
    strips::find(scene, &mut pieces, grown);
    compete::settle(scene, &mut pieces, monitor)?;
    strips::bridge(scene, &mut pieces, grown);
    for (node, other) in strips::joints(scene, &pieces, grown) {
        scene.links.join(node, other);
    }
    let scene = &*scene;
    monitor.progress(0.6);
    let count = pieces.surfaces.len() - 1;
    let mut labels = pieces.labels.clone();
    let models = Models::new(scene, &pieces);
    // First where it is certain, so that borders grow longer and tell more.
    for certain in [true, false] {
        let strength = |labels: &[u32], border: &Border, sizes: [usize; 2]| {
            match models.planes(scene, labels, border, sizes) {
                Some(Planes::Apart) => return None,
                Some(Planes::Together) => return Some(0.0),
                None => {}
            }
            let is_small = sizes[0].min(sizes[1]) <= SMALL;
            let is_beside_plane = models.beside_plane(scene, labels, border, sizes);
            let most = if is_beside_plane {
                STEPS_OF_PLANE
            } else {
                STEPS
            };
            if border.steps > most * border.pairs.len() {
                return None;
            }
            if certain || !is_small && is_beside_plane {
                return border::strength(scene, labels, border, 1.0);
            }
            let near = border::strength(scene, labels, border, 0.0);
            let models = if is_small {
                models.strength(scene, &border.pairs)
            } else {
                models.strength_of_large(scene, &border.pairs)
            };
            match (near, models) {
                (Some(near), Some(models)) => Some(near.min(models)),
                (near, models) => near.or(models),
            }
        };
        merge(scene, &mut labels, strength, monitor)?;
    }
    revise::clear_slivers(scene, &mut labels);
    Ok((labels, count))
}
