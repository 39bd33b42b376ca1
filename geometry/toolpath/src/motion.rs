//! What a machine is told to do.

use crate::cutter::Cutter;

/// A plane that arcs lie in, as G17, G18 and G19 choose it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// G17
    Xy,
    /// G18
    Zx,
    /// G19
    Yz,
}

impl Plane {
    /// Indices of its two axes; a turn from the first to the second is counter-clockwise (G3).
    #[must_use]
    pub fn axes(self) -> [usize; 2] {
        match self {
            Self::Xy => [0, 1],
            Self::Zx => [2, 0],
            Self::Yz => [1, 2],
        }
    }
}

/// An arc, from where the tool is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// The plane that it lies in.
    pub plane: Plane,
    /// It turns from the plane's first axis to the second (G3), less than once around.
    pub counter_clockwise: bool,
    /// Its centre, millimetres; the coordinate across the plane does not matter.
    pub centre_mm: [f64; 3],
}

/// How the tool goes to where it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Travel {
    /// As fast as the machine can (G0).
    Rapid,
    /// Straight (G1).
    Line,
    /// Around (G2, G3).
    Arc(Arc),
}

/// A move of the tool's tip, from where the one before ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// How.
    pub travel: Travel,
    /// Where to, millimetres, in the coordinates of the model.
    pub to_mm: [f64; 3],
    /// How fast; rapids leave it aside.
    pub feed_mm_per_min: f64,
}

/// Everything that one tool does.
#[derive(Debug, Clone, PartialEq)]
pub struct Operation {
    /// What it is for, in a word or two.
    pub name: String,
    /// The tool's number in the machine.
    pub tool: u32,
    /// The cutter.
    pub cutter: Cutter,
    /// Speed of the spindle.
    pub spindle_rpm: f64,
    /// Whether coolant flows.
    pub coolant: bool,
    /// Its moves; the first is a rapid one that says where everything begins.
    pub moves: Vec<Move>,
    /// How many passes it makes.
    pub passes: usize,
}

impl Move {
    /// A rapid move.
    #[must_use]
    pub fn rapid(to_mm: [f64; 3]) -> Self {
        Self {
            travel: Travel::Rapid,
            to_mm,
            feed_mm_per_min: 0.0,
        }
    }

    /// A straight one.
    #[must_use]
    pub fn line(to_mm: [f64; 3], feed_mm_per_min: f64) -> Self {
        Self {
            travel: Travel::Line,
            to_mm,
            feed_mm_per_min,
        }
    }

    /// How long it is from `from_mm`, millimetres.
    #[must_use]
    pub fn length_mm(&self, from_mm: [f64; 3]) -> f64 {
        match &self.travel {
            Travel::Rapid | Travel::Line => distance(from_mm, self.to_mm),
            Travel::Arc(arc) => {
                let turn = arc.turn(from_mm, self.to_mm);
                let [a, b] = arc.plane.axes();
                let across = 3 - a - b;
                let radius = arc.radius_mm(from_mm);
                let rise = self.to_mm[across] - from_mm[across];
                let round = radius * turn.abs();
                (round * round + rise * rise).sqrt()
            }
        }
    }

    /// Points on the way, the last included, so close that straight lines between them stay within
    /// `tolerance_mm` of it.
    #[must_use]
    pub fn points_mm(&self, from_mm: [f64; 3], tolerance_mm: f64) -> Vec<[f64; 3]> {
        let Travel::Arc(arc) = &self.travel else {
            return vec![self.to_mm];
        };
        let turn = arc.turn(from_mm, self.to_mm);
        let radius = arc.radius_mm(from_mm);
        // The sagitta of a chord over an angle is radius angle^2 / 8.
        let angle = (8.0 * tolerance_mm / radius.max(1e-9)).sqrt().min(0.5);
        let count = (turn.abs() / angle).ceil().clamp(1.0, 1e5) as usize;
        let [a, b] = arc.plane.axes();
        let across = 3 - a - b;
        let start = libm::atan2(from_mm[b] - arc.centre_mm[b], from_mm[a] - arc.centre_mm[a]);
        let mut points = Vec::with_capacity(count);
        for k in 1..count {
            let share = k as f64 / count as f64;
            let (sine, cosine) = libm::sincos(start + share * turn);
            let mut point = [0.0; 3];
            point[a] = arc.centre_mm[a] + radius * cosine;
            point[b] = arc.centre_mm[b] + radius * sine;
            point[across] = from_mm[across] + share * (self.to_mm[across] - from_mm[across]);
            points.push(point);
        }
        points.push(self.to_mm);
        points
    }
}

impl Arc {
    /// Distance of a point from the centre, millimetres.
    #[must_use]
    pub fn radius_mm(&self, from_mm: [f64; 3]) -> f64 {
        let [a, b] = self.plane.axes();
        libm::hypot(
            from_mm[a] - self.centre_mm[a],
            from_mm[b] - self.centre_mm[b],
        )
    }

    /// By which angle it turns, positive counter-clockwise, radians.
    #[must_use]
    pub fn turn(&self, from_mm: [f64; 3], to_mm: [f64; 3]) -> f64 {
        let [a, b] = self.plane.axes();
        let angle = |p: [f64; 3]| libm::atan2(p[b] - self.centre_mm[b], p[a] - self.centre_mm[a]);
        let turn = angle(to_mm) - angle(from_mm);
        let whole = core::f64::consts::TAU;
        match self.counter_clockwise {
            true if turn <= 0.0 => turn + whole,
            false if turn >= 0.0 => turn - whole,
            _ => turn,
        }
    }
}

pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square = |k: usize| (a[k] - b[k]) * (a[k] - b[k]);
    (square(0) + square(1) + square(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_has_the_length_of_its_turn_and_points_on_it() {
        let arc = Arc {
            plane: Plane::Zx,
            counter_clockwise: true,
            centre_mm: [0.0; 3],
        };
        // From +z to +x: a quarter.
        let quarter = Move {
            travel: Travel::Arc(arc),
            to_mm: [2.0, 5.0, 0.0],
            feed_mm_per_min: 1.0,
        };
        let from = [0.0, 5.0, 2.0];
        assert!((quarter.length_mm(from) - core::f64::consts::PI).abs() < 1e-12);
        for [x, y, z] in quarter.points_mm(from, 1e-4) {
            assert!((libm::hypot(x, z) - 2.0).abs() < 1e-12 && y == 5.0);
            assert!(x >= 0.0 && z >= -1e-12);
        }
        let mut back = quarter;
        back.travel = Travel::Arc(Arc {
            counter_clockwise: false,
            ..arc
        });
        assert!((back.length_mm(from) - 3.0 * core::f64::consts::PI).abs() < 1e-12);
    }
}
