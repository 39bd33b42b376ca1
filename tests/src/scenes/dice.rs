//! Random choices for the shapes of scenes.

use super::Set;
use sim_scanner::Vec3;
use sim_scanner::random::{Draws, Purpose};

/// The choices of one candidate.
#[derive(Debug)]
pub(super) struct Dice(Draws);

impl Dice {
    pub(super) fn new(set: Set, seed: u64, attempt: u64) -> Self {
        Self(Draws::keyed(seed, Purpose::Scene, &[set as u64, attempt]))
    }

    /// Uniform in [low, high).
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.between(low, high)
    }

    /// The same in degrees, given in radians.
    pub(super) fn degrees(&mut self, low: f64, high: f64) -> f64 {
        self.between(low, high).to_radians()
    }

    /// Uniform among low..=high.
    pub(super) fn count(&mut self, low: u64, high: u64) -> u64 {
        low + self.0.bits() % (high - low + 1)
    }

    pub(super) fn chance(&mut self, share: f64) -> bool {
        self.0.uniform() < share
    }

    pub(super) fn turn(&mut self) -> f64 {
        self.between(0.0, core::f64::consts::TAU)
    }

    /// Uniform on the cap of the unit sphere up to an angle from +z.
    pub(super) fn direction(&mut self, reach_rad: f64) -> Vec3 {
        let z = self.between(libm::cos(reach_rad), 1.0);
        let (sin, cos) = libm::sincos(self.turn());
        let r = libm::sqrt((1.0 - z * z).max(0.0));
        Vec3::new(r * cos, r * sin, z)
    }
}
