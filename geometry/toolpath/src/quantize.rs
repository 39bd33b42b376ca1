//! Moves as they are written: coordinates with few decimals.

use crate::motion::{Arc, Move, Travel};
use crate::post::{rounded, scale};

/// A place that rounding moves goes up by so many units of the last decimal at most: at a wall it may
/// come to stand above that.
const HIGHEST_LIFT: f64 = 20.0;

/// Rounds coordinates to so many decimals, heights upwards, so that rounding takes no material; where
/// a slope rises towards the rounded place, up to `tip`, the least height of the tip there. What does
/// not move any more is left out. Centres of arcs are put as far from one end as from the
/// other; an arc that rounding has made meaningless becomes a line.
pub(crate) fn quantized(
    moves: &[Move],
    decimals: u8,
    tip: &dyn Fn([f64; 2]) -> Option<f64>,
) -> Vec<Move> {
    let scale = scale(decimals);
    let mut out: Vec<Move> = Vec::with_capacity(moves.len());
    for step in moves {
        let [x, y, z] = step.to_mm;
        // What is on the grid already stays, by rounding, too.
        let up = |z: f64| (z * scale - 1e-6).ceil() / scale + 0.0;
        let place = [rounded(x, decimals), rounded(y, decimals)];
        let mut height = up(z);
        if step.travel != Travel::Rapid
            && let Some(least) = tip(place)
            && least - height <= HIGHEST_LIFT / scale
        {
            height = height.max(up(least));
        }
        let to_mm = [place[0], place[1], height];
        let Some(from) = out.last().map(|last| last.to_mm) else {
            out.push(Move { to_mm, ..*step });
            continue;
        };
        if from == to_mm {
            continue;
        }
        let travel = match step.travel {
            Travel::Arc(arc) => {
                centred(arc, from, to_mm, decimals).map_or(Travel::Line, Travel::Arc)
            }
            other => other,
        };
        out.push(Move {
            travel,
            to_mm,
            ..*step
        });
    }
    out
}

/// The arc with its centre on the line that is as far from both ends, next to where it was.
fn centred(arc: Arc, from: [f64; 3], to: [f64; 3], decimals: u8) -> Option<Arc> {
    let [a, b] = arc.plane.axes();
    let chord = [to[a] - from[a], to[b] - from[b]];
    let square = chord[0] * chord[0] + chord[1] * chord[1];
    let least = 10.0 / scale(decimals);
    if square < least * least {
        return None;
    }
    let middle = [f64::midpoint(from[a], to[a]), f64::midpoint(from[b], to[b])];
    let off = [arc.centre_mm[a] - middle[0], arc.centre_mm[b] - middle[1]];
    let share = (off[0] * chord[0] + off[1] * chord[1]) / square;
    let mut centre_mm = from;
    for (k, axis) in [a, b].into_iter().enumerate() {
        let centre = middle[k] + off[k] - share * chord[k];
        // Written from the start, as I, J and K.
        centre_mm[axis] = from[axis] + rounded(centre - from[axis], decimals);
    }
    Some(Arc { centre_mm, ..arc })
}
