//! Pieces to digits.

use super::pieces::{Piece, least_rise_mm, pieces};
use super::{Digit, End, Section};

/// Flatter than this is level: 15 degrees.
const LEVEL_SLOPE: f64 = 0.267_949_192_431_122_7;
/// Flatter than this, what slants is a floor, else a wall: 30 degrees.
const FLOOR_SLOPE: f64 = 0.577_350_269_189_625_8;
/// Steeper than this is straight up or down: 70 degrees.
const STRAIGHT_SLOPE: f64 = 2.747_477_419_454_622;
/// What rises less than this share of the whole section is no wall.
const LEAST_SHARE: f64 = 0.04;
/// A slant beside a wall, of the same sense and no higher than this share of its height, is the
/// wall's bend: a chamfer or a fillet.
const BEND_SHARE: f64 = 0.3;
/// A bend is no longer than this share of the wall's height; what is longer is a floor.
const BEND_RUN_SHARE: f64 = 0.5;
/// A level piece between two walls of one sense that is no longer than so many pitches is a sample
/// on a wall, not a floor.
const LEDGE_PITCHES: f64 = 2.5;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    digit: Digit,
    run_mm: f64,
    rise_mm: f64,
}

impl Part {
    fn of(piece: &Piece, least_mm: f64) -> Self {
        let (run_mm, rise_mm) = (piece.run_mm().max(0.0), piece.rise_mm());
        let mut part = Self {
            digit: Digit::Level,
            run_mm,
            rise_mm,
        };
        part.digit = match (piece.is_jump, rise_mm > 0.0) {
            _ if rise_mm.abs() < least_mm => Digit::Level,
            (true, true) => Digit::Up,
            (true, false) => Digit::Down,
            (false, _) => part.sloped(),
        };
        part
    }

    fn sloped(&self) -> Digit {
        let rise = self.rise_mm.abs();
        let digit = if rise > STRAIGHT_SLOPE * self.run_mm {
            Digit::Up
        } else if rise > LEVEL_SLOPE * self.run_mm {
            Digit::Rising
        } else {
            Digit::Level
        };
        if self.rise_mm < 0.0 {
            digit.turned()
        } else {
            digit
        }
    }

    fn is_straight(&self) -> bool {
        matches!(self.digit, Digit::Up | Digit::Down)
    }

    fn is_slanting(&self) -> bool {
        matches!(self.digit, Digit::Rising | Digit::Falling)
    }

    fn is_wall(&self) -> bool {
        self.is_straight() || self.is_slanting() && self.rise_mm.abs() > FLOOR_SLOPE * self.run_mm
    }

    /// Whether both go up, or both down.
    fn agrees(&self, other: &Self) -> bool {
        self.digit != Digit::Level
            && other.digit != Digit::Level
            && (self.rise_mm > 0.0) == (other.rise_mm > 0.0)
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            digit: self.digit,
            run_mm: self.run_mm + other.run_mm,
            rise_mm: self.rise_mm + other.rise_mm,
        }
    }
}

/// The code of a section; nothing of fewer than two points, or where no wall stands between rims.
///
/// Levels that differ by less than 6 times the noise, or 4 % of the section's height, are one. A
/// jump between neighbours is a wall, and so is one over a gap that a wall's shadow leaves.
#[must_use]
pub fn code(section: &Section<'_>) -> Vec<Digit> {
    let pieces = pieces(section);
    let heights = pieces.iter().flat_map(|piece| [piece.from[1], piece.to[1]]);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    let least_mm = least_rise_mm(section).max(LEAST_SHARE * (high - low));
    let parts = pieces.iter().map(|piece| Part::of(piece, least_mm));
    let mut parts = joined(parts.collect());
    without_ledges(&mut parts, LEDGE_PITCHES * section.pitch_mm);
    let mut parts = joined(parts);
    while let Some(k) = bend(&parts) {
        parts.remove(k);
        parts = joined(parts);
    }
    let parts = without_rims(&parts, section.ends);
    let mut code = Vec::new();
    for part in parts {
        if part.is_wall() {
            let bend = if part.rise_mm > 0.0 {
                Digit::Rising
            } else {
                Digit::Falling
            };
            code.extend([bend, part.digit, bend]);
        } else {
            code.push(part.digit);
        }
    }
    code
}

/// Neighbours of one direction are one; so are slants of one sense that are both walls or both
/// floors, as the pieces of a fillet are.
fn joined(parts: Vec<Part>) -> Vec<Part> {
    let mut joined: Vec<Part> = Vec::new();
    for part in parts {
        match joined.last_mut() {
            Some(last) if last.digit == part.digit && last.is_wall() == part.is_wall() => {
                *last = last.with(&part);
            }
            _ => joined.push(part),
        }
    }
    joined
}

fn without_ledges(parts: &mut Vec<Part>, ledge_mm: f64) {
    let mut k = 1;
    while k + 1 < parts.len() {
        let [before, own, behind] = [parts[k - 1], parts[k], parts[k + 1]];
        let is_ledge = !own.is_wall() && own.run_mm <= ledge_mm;
        if is_ledge && before.is_straight() && before.digit == behind.digit {
            parts[k - 1] = before.with(&own).with(&behind);
            parts.drain(k..=k + 1);
        } else {
            k += 1;
        }
    }
}

/// A slant that is but the bend of the wall beside it, and not all the floor between two walls.
fn bend(parts: &[Part]) -> Option<usize> {
    (0..parts.len()).find(|&k| {
        let own = &parts[k];
        let before = k.checked_sub(1).and_then(|k| parts.get(k));
        let behind = parts.get(k + 1);
        let is_bend_of = |wall: Option<&Part>| {
            wall.is_some_and(|wall| {
                let height_mm = wall.rise_mm.abs();
                wall.is_wall()
                    && wall.agrees(own)
                    && own.rise_mm.abs() <= BEND_SHARE * height_mm
                    && own.run_mm <= BEND_RUN_SHARE * height_mm
            })
        };
        let is_wall = |part: Option<&Part>| part.is_some_and(Part::is_wall);
        let is_floor = !own.is_wall() && is_wall(before) && is_wall(behind);
        own.is_slanting() && !is_floor && (is_bend_of(before) || is_bend_of(behind))
    })
}

fn without_rims(parts: &[Part], ends: [End; 2]) -> &[Part] {
    let mut left = parts;
    if ends[0] == End::Rim {
        while let [first, rest @ ..] = left
            && !first.is_wall()
        {
            left = rest;
        }
    }
    if ends[1] == End::Rim {
        while let [rest @ .., last] = left
            && !last.is_wall()
        {
            left = rest;
        }
    }
    left
}
