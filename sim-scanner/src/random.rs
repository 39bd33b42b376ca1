//! Random draws keyed by what is measured.
//!
//! A draw depends on the seed and on its key alone, so a column is the same whenever it is
//! asked for, and one setting changed leaves the draws of the others where they were.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What a stream of draws is for; streams of different purposes are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Noise, outliers and dropouts of one sample.
    Sample = 1,
    /// The part of the noise that is frozen to a surface point.
    Speckle = 2,
    /// Where runs of clustered outliers start.
    Cluster = 3,
    /// Position errors of the table.
    Table = 4,
    /// Faults of the line.
    Line = 5,
    /// The lie of a column's rays.
    Fan = 6,
    /// The shape of a scene that is drawn from a seed.
    Scene = 7,
    /// Mishaps of the device.
    Mishap = 8,
    /// Readings lost to gloss and to stains.
    Loss = 9,
}

/// A stream of draws.
#[derive(Debug, Clone)]
pub struct Draws(Xoshiro256PlusPlus);

impl Draws {
    /// The stream of `seed` for a purpose and a key.
    #[must_use]
    pub fn keyed(seed: u64, purpose: Purpose, key: &[u64]) -> Self {
        let start = mix(seed ^ mix(purpose as u64));
        let state = key.iter().fold(start, |state, part| {
            mix(state ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15))
        });
        Self(Xoshiro256PlusPlus::seed_from_u64(state))
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        // 53 bits fill the mantissa exactly.
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in \[low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        radius * libm::cos(core::f64::consts::TAU * self.uniform())
    }
}

/// The finaliser of splitmix64: every input bit reaches every output bit.
fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_names_its_draws_and_no_others() {
        let first = |seed, purpose, key: &[u64]| Draws::keyed(seed, purpose, key).bits();
        let here = first(1, Purpose::Sample, &[3, 4]);
        assert_eq!(here, first(1, Purpose::Sample, &[3, 4]));
        for other in [
            first(2, Purpose::Sample, &[3, 4]),
            first(1, Purpose::Table, &[3, 4]),
            first(1, Purpose::Sample, &[4, 3]),
            first(1, Purpose::Sample, &[3]),
        ] {
            assert_ne!(here, other);
        }
    }

    #[test]
    fn draws_have_the_moments_of_their_laws() {
        let mut draws = Draws::keyed(5, Purpose::Sample, &[]);
        let count = 20_000;
        let uniform: Vec<f64> = (0..count).map(|_| draws.uniform()).collect();
        let normal: Vec<f64> = (0..count).map(|_| draws.normal()).collect();
        let mean = |v: &[f64]| v.iter().sum::<f64>() / f64::from(count);
        let variance = |v: &[f64]| {
            let m = mean(v);
            v.iter().map(|x| (x - m) * (x - m)).sum::<f64>() / f64::from(count)
        };
        assert!((mean(&uniform) - 0.5).abs() < 0.01);
        assert!((variance(&uniform) - 1.0 / 12.0).abs() < 0.002);
        assert!(mean(&normal).abs() < 0.03);
        assert!((variance(&normal) - 1.0).abs() < 0.05);
    }
}
