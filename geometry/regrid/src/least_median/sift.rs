//! The best of many planes, most of which are thrown out by a rough look.

use super::median::median_below;
use super::planes::{MOST, Planes};
use super::rough::{LANES, RoughPlanes};
use super::window::{Extent, UP, Window};
use crate::plane::Plane;

/// The plane with the least median of squares of those whose median is less than `least`, the
/// first of equal ones; `least` becomes its median.
#[inline(always)]
pub(super) fn best<const FUSED: bool>(
    window: &mut Window,
    extent: &Extent,
    planes: &Planes,
    least: &mut f64,
) -> Option<Plane> {
    let rough = RoughPlanes::new(planes, extent);
    // As many samples may lie beyond the median, with those that fill the last block.
    let most_beyond = (window.padded_len() - window.middle() - 1) as u32;
    let limit = |least: f64| UP * least.sqrt() as f32;
    let mut beyond = [0; MOST];
    for start in (0..planes.len()).step_by(LANES) {
        let lanes = rough.beyond::<FUSED>(start, window.rough(), limit(*least));
        beyond[start..start + LANES].copy_from_slice(&lanes);
    }
    let beyond = &beyond[..planes.len()];

    // The likeliest first: what its median leaves of the others is little.
    let mut likeliest = None;
    let mut fewest = most_beyond + 1;
    for (k, number) in beyond.iter().enumerate() {
        if *number < fewest {
            (likeliest, fewest) = (Some(k), *number);
        }
    }
    let likeliest = likeliest?;
    let mut best: Option<usize> = None;
    if let Some(median) = median_below(window, &planes.plane(likeliest), *least) {
        (*least, best) = (median, Some(likeliest));
    }
    for (k, number) in beyond.iter().enumerate() {
        if *number > most_beyond || k == likeliest {
            continue;
        }
        if best.is_some()
            && rough.beyond_one::<FUSED>(k, window.rough(), limit(*least)) > most_beyond
        {
            continue;
        }
        // Of equal planes the first drawn is taken.
        let under = if best.is_some_and(|best| k < best) {
            least.next_up()
        } else {
            *least
        };
        if let Some(median) = median_below(window, &planes.plane(k), under) {
            (*least, best) = (median, Some(k));
        }
    }
    best.map(|k| planes.plane(k))
}
