//! Ideal sections: chains of walls and floors.

use crate::chance::Chance;

/// How a wall is made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wall {
    /// Along the section, millimetres; 0 for a vertical wall.
    pub(super) run_mm: f64,
    /// What is taken off, or left, at its upper and its lower edge, millimetres.
    pub(super) upper: Edge,
    pub(super) lower: Edge,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Edge {
    Sharp,
    Chamfer(f64),
    Round(f64),
}

impl Edge {
    fn size_mm(self) -> f64 {
        match self {
            Self::Sharp => 0.0,
            Self::Chamfer(size) | Self::Round(size) => size,
        }
    }

    /// Corners of a quarter of it, unit square: from (0, 0) level to (1, 1) upright.
    fn corners(self) -> Vec<[f64; 2]> {
        const ARC: usize = 8;
        match self {
            Self::Sharp => Vec::new(),
            Self::Chamfer(_) => vec![[0.0, 0.0], [1.0, 1.0]],
            Self::Round(_) => {
                let at = |k: usize| {
                    let angle = core::f64::consts::FRAC_PI_2 * k as f64 / ARC as f64;
                    [libm::sin(angle), 1.0 - libm::cos(angle)]
                };
                (0..=ARC).map(at).collect()
            }
        }
    }
}

/// A section under construction, from left to right.
#[derive(Debug, Clone)]
pub(super) struct Profile {
    pub(super) corners: Vec<[f64; 2]>,
}

impl Profile {
    pub(super) fn new() -> Self {
        Self {
            corners: vec![[0.0, 0.0]],
        }
    }

    fn end(&self) -> [f64; 2] {
        self.corners.last().copied().unwrap_or_default()
    }

    /// A straight piece.
    pub(super) fn line(&mut self, run_mm: f64, rise_mm: f64) -> &mut Self {
        let [s, z] = self.end();
        self.corners.push([s + run_mm, z + rise_mm]);
        self
    }

    /// A wall that goes so far up, or down where that is negative.
    pub(super) fn wall(&mut self, rise_mm: f64, wall: &Wall) -> &mut Self {
        let [s, z] = self.end();
        let is_up = rise_mm > 0.0;
        let (first, last) = if is_up {
            (wall.lower, wall.upper)
        } else {
            (wall.upper, wall.lower)
        };
        let (a, b) = (first.size_mm(), last.size_mm());
        let sign = if is_up { 1.0 } else { -1.0 };
        for [x, y] in first.corners() {
            self.corners.push([s + a * x, z + sign * a * y]);
        }
        let (foot, head) = (s + a, s + a + wall.run_mm);
        self.corners.push([foot, z + sign * a]);
        self.corners.push([head, z + rise_mm - sign * b]);
        for [x, y] in last.corners().into_iter().rev() {
            self.corners
                .push([head + b * (1.0 - x), z + rise_mm - sign * b * y]);
        }
        self
    }

    /// A floor with two waves, no steeper than about 20 degrees and leading nowhere.
    pub(super) fn waves(&mut self, run_mm: f64, chance: &mut Chance) -> &mut Self {
        const CORNERS: usize = 40;
        let [s, z] = self.end();
        let steepest = chance.between(0.1, 0.36);
        let waves = [chance.between(0.5, 1.0), chance.between(1.0, 2.0)];
        let phases = [0, 1].map(|_| chance.between(0.0, core::f64::consts::TAU));
        let height = |share: f64| {
            let one = |k: usize| {
                let turn = core::f64::consts::TAU * waves[k];
                0.5 * steepest * run_mm / turn * libm::sin(turn * share + phases[k])
            };
            one(0) + one(1)
        };
        for k in 1..=CORNERS {
            let share = k as f64 / CORNERS as f64;
            self.corners
                .push([s + share * run_mm, z + height(share) - height(0.0)]);
        }
        self
    }

    /// The same seen from the other side.
    pub(super) fn mirrored(mut self) -> Self {
        self.corners.reverse();
        for corner in &mut self.corners {
            corner[0] = -corner[0];
        }
        self
    }

    /// Turned in its plane.
    pub(super) fn tilted(mut self, angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        for [s, z] in &mut self.corners {
            (*s, *z) = (cos * *s - sin * *z, sin * *s + cos * *z);
        }
        self
    }

    /// From and to, along s, millimetres.
    pub(super) fn extent_mm(&self) -> [f64; 2] {
        let all = self.corners.iter().map(|corner| corner[0]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| {
            [low.min(s), high.max(s)]
        })
    }

    /// The height seen from above at one place; `None` beside it.
    pub(super) fn height_mm(&self, s: f64) -> Option<f64> {
        let pieces = self.corners.windows(2);
        let seen = pieces.filter_map(|piece| {
            let ([a, from], [b, to]) = (piece[0], piece[1]);
            let (low, high) = (a.min(b), a.max(b));
            if s < low || s > high {
                return None;
            }
            Some(if high > low {
                from + (s - a) / (b - a) * (to - from)
            } else {
                from.max(to)
            })
        });
        seen.max_by(f64::total_cmp)
    }
}
