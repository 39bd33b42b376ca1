//! The best of many planes, most of which are thrown out by a rough look.

use pulp::Simd;

use super::median::median_below;
use super::planes::{MOST, Planes};
use super::window::{UP, Window};
use crate::plane::Plane;

/// The plane with the least median of squares of those whose median is less than `least`, the
/// first of equal ones; `least` becomes its median.
#[inline(always)]
pub(super) fn best<S: Simd>(
    simd: S,
    window: &mut Window,
    planes: &Planes,
    least: &mut f64,
) -> Option<Plane> {
    // As many samples may lie beyond the median.
    let most_beyond = (window.len() - window.middle() - 1) as u32;
    let limit = UP * least.sqrt() as f32;
    let mut beyond = [0; MOST];
    let rough = &planes.rough;
    rough.beyond(simd, planes.len(), window.rough(), limit, &mut beyond);
    // The likeliest first: what its median leaves of the others is little.
    let mut numbered = [0; MOST];
    for ((numbered, number), index) in numbered.iter_mut().zip(&beyond).zip(&INDICES) {
        *numbered = number * MOST as u32 + index;
    }
    let mut likeliest = u32::MAX;
    for numbered in &numbered[..planes.len()] {
        likeliest = likeliest.min(*numbered);
    }
    if likeliest >= (most_beyond + 1) * MOST as u32 {
        return None;
    }
    let likeliest = likeliest as usize % MOST;
    let mut best: Option<usize> = None;
    if let Some(median) = median_below(simd, window, &planes.plane(likeliest), *least) {
        (*least, best) = (median, Some(likeliest));
    }
    for (k, number) in beyond[..planes.len()].iter().enumerate() {
        if *number > most_beyond || k == likeliest {
            continue;
        }
        if best.is_some() {
            let limit = UP * least.sqrt() as f32;
            if rough.beyond_one(simd, k, window.rough(), limit) > most_beyond {
                continue;
            }
        }
        // Of equal planes the first drawn is taken.
        let under = if best.is_some_and(|best| k < best) {
            least.next_up()
        } else {
            *least
        };
        if let Some(median) = median_below(simd, window, &planes.plane(k), under) {
            (*least, best) = (median, Some(k));
        }
    }
    best.map(|k| planes.plane(k))
}

const INDICES: [u32; MOST] = {
    let mut indices = [0; MOST];
    let mut k = 0;
    while k < MOST {
        indices[k] = k as u32;
        k += 1;
    }
    indices
};
