//! Moves as they are written: coordinates with few decimals.

use crate::motion::{Arc, Move, Travel};
use crate::post::{rounded, scale};

/// A place that rounding moves goes up by so many units of the last decimal at most: at a wall it may
/// come to stand above that.
const HIGHEST_LIFT: f64 = 20.0;
/// Between its ends a line may be below the least height of the tip by so much, a little more than
/// samples leave: 0.3 um.
const SAG_MM: f64 = 3e-4;

/// Rounds coordinates to so many decimals, heights upwards, so that rounding takes no material; where
/// a slope rises towards the rounded place, up to `tip`, the least height of the tip there, and up to
/// where the lines that meet there lead on to: one whose end is moved along it must stay as high as it
/// was. A line that would go through a hump between its ends goes up as well. What does not move any more is left out. Centres of arcs are put as far from one end as from the
/// other; an arc that rounding has made meaningless becomes a line.
pub(crate) fn quantized(
    moves: &[Move],
    decimals: u8,
    tip: &dyn Fn([f64; 2]) -> Option<f64>,
) -> Vec<Move> {
    let scale = scale(decimals);
    let mut out: Vec<Move> = Vec::with_capacity(moves.len());
    for (k, step) in moves.iter().enumerate() {
        let [x, y, z] = step.to_mm;
        // What is on the grid already stays, by rounding, too.
        let up = |z: f64| (z * scale - 1e-6).ceil() / scale + 0.0;
        let place = [rounded(x, decimals), rounded(y, decimals)];
        let mut height = up(z);
        let meeting = |line: &Move, other: &Move| led_on(line, step.to_mm, other.to_mm, place);
        let before = k.checked_sub(1).and_then(|k| moves.get(k));
        let before = before.and_then(|before| meeting(step, before));
        let behind = moves.get(k + 1).and_then(|next| meeting(next, next));
        let touching = match step.travel {
            Travel::Rapid => None,
            _ => tip(place),
        };
        for least in [before, behind, touching].into_iter().flatten() {
            if least - height <= HIGHEST_LIFT / scale {
                height = height.max(up(least));
            }
        }
        let mut to_mm = [place[0], place[1], height];
        let Some(from) = out.last().map(|last| last.to_mm) else {
            out.push(Move { to_mm, ..*step });
            continue;
        };
        if step.travel == Travel::Line {
            let lift = lack_mm(from, to_mm, tip).filter(|lack| *lack <= HIGHEST_LIFT / scale);
            to_mm[2] = lift.map_or(height, |lift| up(height + lift));
        }
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

/// How much higher a line must end for no place on it to be below the tip, if any is by more than a
/// line may be: both ends moved towards a hump by rounding, the hump between them stays.
fn lack_mm(from: [f64; 3], to: [f64; 3], tip: &dyn Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
    let lack = |share: f64| {
        let [x, y, z] = [0, 1, 2].map(|k| from[k] + share * (to[k] - from[k]));
        let lack = tip([x, y])? - z;
        (lack > SAG_MM).then_some(lack / share)
    };
    [0.25, 0.5, 0.75]
        .into_iter()
        .filter_map(lack)
        .reduce(f64::max)
}

/// The height to which a line with these ends leads on at a place close to the first.
fn led_on(line: &Move, end: [f64; 3], other: [f64; 3], place: [f64; 2]) -> Option<f64> {
    let way = [end[0] - other[0], end[1] - other[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    if line.travel != Travel::Line || square == 0.0 {
        return None;
    }
    let aside = (place[0] - end[0]) * way[0] + (place[1] - end[1]) * way[1];
    Some(end[2] + (end[2] - other[2]) * aside / square)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rising_line_whose_end_is_moved_on_stays_as_high() {
        let line = |x: f64, z: f64| Move::line([x, 0.0, z], 1.0);
        // Up a wall from either side; the tops are moved away from it.
        let (foot, top, beyond) = (0.2, 0.4146, 0.6004);
        let moves = [
            line(foot, 0.0),
            line(top, 1.0),
            line(beyond, 1.0),
            line(0.8, 0.0),
        ];
        let rounded = quantized(&moves, 3, &|_| None);
        let height = |moves: &[Move], x: f64| {
            let pair = moves
                .windows(2)
                .find(|pair| (pair[0].to_mm[0]..=pair[1].to_mm[0]).contains(&x));
            let [a, b] = pair.unwrap() else { panic!() };
            let share = (x - a.to_mm[0]) / (b.to_mm[0] - a.to_mm[0]);
            a.to_mm[2] + share * (b.to_mm[2] - a.to_mm[2])
        };
        assert_eq!(rounded[1].to_mm[0], 0.415);
        assert_eq!(rounded[2].to_mm[0], 0.6);
        for k in 0..=600 {
            let x = 0.2 + f64::from(k) / 1000.0;
            let above = height(&rounded, x) - height(&moves, x);
            assert!((-1e-9..0.005).contains(&above), "{x}: {above}");
        }
    }

    #[test]
    fn a_line_moved_into_a_hump_goes_over_it() {
        // A hump that falls off steeply to the side, and a line beside it that rounding moves to it.
        let tip = |[x, y]: [f64; 2]| Some(0.003 - 0.3 * x * x - 5.0 * y.abs());
        let line = |x: f64, y: f64| Move::line([x, y, 0.0006], 1.0);
        let moves = [line(-0.1, 4.8e-4), line(0.1, 4.8e-4)];
        let rounded = quantized(&moves, 3, &|at| tip(at));
        let [a, b] = [0, 1].map(|k: usize| rounded[k].to_mm);
        assert_eq!((a[1], b[1]), (0.0, 0.0));
        for k in 0..=100 {
            let at = [0, 1, 2].map(|i| a[i] + f64::from(k) / 100.0 * (b[i] - a[i]));
            let above = at[2] - tip([at[0], at[1]]).unwrap();
            assert!((-SAG_MM..0.007).contains(&above), "{k}: {above}");
        }
    }
}
