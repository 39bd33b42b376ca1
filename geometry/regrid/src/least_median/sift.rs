//! The best of many planes, most of which are thrown out by a rough look.

use super::lanes::Lanes;
use super::median::{Known, median};
use super::planes::Planes;
use super::window::{UP, Window};
use crate::plane::Plane;

/// Where more planes than this are left, all are looked at together once more.
const FEW: u32 = 8;

/// The plane with the least median of squares of those whose median is less than `least`, the
/// first of equal ones; `least` becomes its median. If `least` is but a guess, the least of all.
#[inline(always)]
pub(super) fn best<L: Lanes>(
    lanes: L,
    window: &mut Window,
    planes: &Planes,
    least: &mut f64,
    is_guess: bool,
) -> Option<Plane> {
    // So many samples are within of whatever is better.
    let fewest = window.middle() as u32 + 1;
    let mut best: Option<(usize, Plane)> = None;
    let mut tried = 0_u64;
    loop {
        let sifted_by = *least;
        let sifted = planes.sift(lanes, window, rough_limit(sifted_by), fewest);
        let mut left = sifted.left & !tried;
        let is_first = tried == 0;
        if left == 0 && !(is_first && is_guess) {
            return best.map(|(_, plane)| plane);
        }
        // The likeliest first: what its median leaves of the others is little.
        let mut slot = if is_first {
            sifted.likeliest
        } else {
            left.trailing_zeros() as usize
        };
        loop {
            tried |= 1 << slot;
            left &= !(1 << slot);
            if let Some(plane) = planes.plane(window, slot) {
                let known = match best {
                    None if is_guess => Known::Guess(*least),
                    // Of equal planes the first drawn is taken.
                    Some((best, _)) if slot < best => Known::Limit(least.next_up()),
                    _ => Known::Limit(*least),
                };
                if let Some(median) = median(lanes, window, &plane, known) {
                    (*least, best) = (median, Some((slot, plane)));
                }
            }
            // A guess that was too low has thrown out planes that may be better.
            if is_first && (*least > sifted_by || left.count_ones() > FEW) {
                break;
            }
            let limit = rough_limit(*least);
            loop {
                if left == 0 {
                    return best.map(|(_, plane)| plane);
                }
                slot = left.trailing_zeros() as usize;
                if planes.within_one(lanes, slot, window.rough(), limit) >= fewest {
                    break;
                }
                left &= left - 1;
            }
        }
    }
}

/// Residuals whose squares are below a limit are below this.
fn rough_limit(least: f64) -> f32 {
    UP * least.sqrt() as f32
}
