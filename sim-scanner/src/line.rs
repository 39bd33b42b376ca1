//! A bad line between device and host: seeded faults on the bytes that pass.
//!
//! Faults are written as `key=value` pairs joined by commas:
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `flip` | rate per bit | a bit is turned over |
//! | `lose` | rate per byte | a byte is lost |
//! | `garbage` | rate per byte | 1 to 64 random bytes are put in |
//! | `stall` | rate per byte | nothing passes for `stall-ms` |
//! | `stall-ms` | milliseconds, 200 if left out | length of a stall |
//! | `to` | `host`, `device` or `both` (the default) | direction that suffers |
//! | `seed` | number, 0 if left out | seed of the faults |
//!
//! Example: `flip=1e-5,lose=1e-5,seed=7`.

use core::str::FromStr;
use core::time::Duration;

use thiserror::Error;

use crate::random::{Draws, Purpose};

/// Rates of faults; 0 for none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFaults {
    /// Rate of turned bits, per bit.
    pub flip: f64,
    /// Rate of lost bytes, per byte.
    pub lose: f64,
    /// Rate of bursts of garbage, per byte.
    pub garbage: f64,
    /// Rate of stalls, per byte.
    pub stall: f64,
    /// Length of a stall.
    pub stall_time: Duration,
    /// Whether bytes for the host suffer.
    pub to_host: bool,
    /// Whether bytes for the device suffer.
    pub to_device: bool,
    /// Seed of the faults.
    pub seed: u64,
}

impl Default for LineFaults {
    fn default() -> Self {
        Self {
            flip: 0.0,
            lose: 0.0,
            garbage: 0.0,
            stall: 0.0,
            stall_time: Duration::from_millis(200),
            to_host: true,
            to_device: true,
            seed: 0,
        }
    }
}

/// Why a text is no list of faults.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LineFaultsError {
    /// A part is not `key=value`.
    #[error("{0:?} is not of the form key=value")]
    NoPair(String),
    /// A key is not known.
    #[error("unknown fault {0:?}; known are flip, lose, garbage, stall, stall-ms, to and seed")]
    UnknownKey(String),
    /// A value does not suit its key.
    #[error("{key}: {value:?} is not {wanted}")]
    Value {
        /// The key.
        key: String,
        /// What was given.
        value: String,
        /// What is wanted.
        wanted: &'static str,
    },
}

impl FromStr for LineFaults {
    type Err = LineFaultsError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut faults = Self::default();
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| LineFaultsError::NoPair(part.into()))?;
            let wrong = |wanted| LineFaultsError::Value {
                key: key.into(),
                value: value.into(),
                wanted,
            };
            let rate = || match value.parse::<f64>() {
                Ok(rate) if (0.0..=0.5).contains(&rate) => Ok(rate),
                _ => Err(wrong("a rate from 0 to 0.5")),
            };
            match key {
                "flip" => faults.flip = rate()?,
                "lose" => faults.lose = rate()?,
                "garbage" => faults.garbage = rate()?,
                "stall" => faults.stall = rate()?,
                "stall-ms" => {
                    let ms = value.parse().ok().filter(|ms| *ms <= 60_000);
                    let ms = ms.ok_or_else(|| wrong("a number of milliseconds up to 60000"))?;
                    faults.stall_time = Duration::from_millis(ms);
                }
                "to" => {
                    (faults.to_host, faults.to_device) = match value {
                        "host" => (true, false),
                        "device" => (false, true),
                        "both" => (true, true),
                        _ => return Err(wrong("host, device or both")),
                    }
                }
                "seed" => faults.seed = value.parse().map_err(|_| wrong("a whole number"))?,
                _ => return Err(LineFaultsError::UnknownKey(key.into())),
            }
        }
        Ok(faults)
    }
}

/// One direction of a bad line.
#[derive(Debug, Clone)]
pub struct BadLine {
    faults: LineFaults,
    draws: Draws,
    /// Places left until the next fault of each sort.
    until_flip: u64,
    until_lose: u64,
    until_garbage: u64,
    until_stall: u64,
    stalls: u32,
}

/// A direction of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the device to the host.
    ToHost,
    /// From the host to the device.
    ToDevice,
}

impl BadLine {
    /// A line with these faults in this direction.
    #[must_use]
    pub fn new(faults: &LineFaults, direction: Direction) -> Self {
        let suffers = match direction {
            Direction::ToHost => faults.to_host,
            Direction::ToDevice => faults.to_device,
        };
        let faults = if suffers {
            *faults
        } else {
            LineFaults::default()
        };
        let mut draws = Draws::keyed(faults.seed, Purpose::Line, &[direction as u64]);
        Self {
            until_flip: gap(faults.flip, &mut draws),
            until_lose: gap(faults.lose, &mut draws),
            until_garbage: gap(faults.garbage, &mut draws),
            until_stall: gap(faults.stall, &mut draws),
            stalls: 0,
            faults,
            draws,
        }
    }

    /// What comes out at the other end.
    pub fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            let mut byte = byte;
            while self.until_flip < 8 {
                byte ^= 1 << self.until_flip;
                self.until_flip = self
                    .until_flip
                    .saturating_add(1)
                    .saturating_add(gap(self.faults.flip, &mut self.draws));
            }
            self.until_flip -= 8;
            if self.due(|line| &mut line.until_garbage, self.faults.garbage) {
                let length = 1 + self.draws.bits() % 64;
                out.extend((0..length).map(|_| self.draws.bits() as u8));
            }
            if self.due(|line| &mut line.until_stall, self.faults.stall) {
                self.stalls += 1;
            }
            if !self.due(|line| &mut line.until_lose, self.faults.lose) {
                out.push(byte);
            }
        }
        out
    }

    /// How long nothing may pass from now on: the stalls met since it was last asked.
    pub fn take_stall(&mut self) -> Option<Duration> {
        let stalls = core::mem::take(&mut self.stalls);
        (stalls > 0).then(|| self.faults.stall_time * stalls)
    }

    fn due(&mut self, until: impl Fn(&mut Self) -> &mut u64, rate: f64) -> bool {
        let left = *until(self);
        if left > 0 {
            *until(self) = left - 1;
            return false;
        }
        let next = gap(rate, &mut self.draws);
        *until(self) = next;
        true
    }
}

/// Places before the next fault: geometric, so that no draw is needed in between.
fn gap(rate: f64, draws: &mut Draws) -> u64 {
    if rate <= 0.0 {
        return u64::MAX;
    }
    let places = libm::log(1.0 - draws.uniform()) / libm::log1p(-rate);
    places as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_faults_reads_as_documented() {
        let faults: LineFaults = "flip=1e-5,lose=2e-5, to=host,stall-ms=50,seed=7"
            .parse()
            .expect("well formed");
        assert_eq!((faults.flip, faults.lose, faults.seed), (1e-5, 2e-5, 7));
        assert!(faults.to_host && !faults.to_device);
        assert_eq!(faults.stall_time, Duration::from_millis(50));
        assert_eq!("".parse(), Ok(LineFaults::default()));
        for (wrong, says) in [
            ("flip", "not of the form"),
            ("flap=1", "unknown fault"),
            ("flip=2", "a rate from 0 to 0.5"),
            ("to=me", "host, device or both"),
            ("seed=-1", "whole number"),
        ] {
            let error = wrong.parse::<LineFaults>().expect_err(wrong).to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn faults_come_at_their_rates_and_the_same_for_a_seed() {
        let faults: LineFaults = "flip=1e-3,lose=5e-3,seed=3".parse().expect("well formed");
        let sent = vec![0_u8; 200_000];
        let mut line = BadLine::new(&faults, Direction::ToHost);
        let got = line.carry(&sent);
        let lost = sent.len() - got.len();
        assert!((900..1100).contains(&lost), "{lost}");
        let flipped: u32 = got.iter().map(|byte| byte.count_ones()).sum();
        assert!((1450..1750).contains(&flipped), "{flipped}");
        // The same whatever the portions.
        let mut again = BadLine::new(&faults, Direction::ToHost);
        let pieces: Vec<u8> = sent.chunks(777).flat_map(|c| again.carry(c)).collect();
        assert_eq!(got, pieces);
        let other = BadLine::new(&faults, Direction::ToDevice).carry(&sent);
        assert_ne!(got, other);
    }

    #[test]
    fn a_good_line_changes_nothing() {
        let mut line = BadLine::new(&LineFaults::default(), Direction::ToHost);
        let sent: Vec<u8> = (0..=255).collect();
        assert_eq!(line.carry(&sent), sent);
        assert_eq!(line.take_stall(), None);
    }

    #[test]
    fn stalls_add_up() {
        let faults: LineFaults = "stall=0.5,stall-ms=10".parse().expect("well formed");
        let mut line = BadLine::new(&faults, Direction::ToHost);
        line.carry(&[0; 100]);
        let stall = line.take_stall().expect("half of the bytes stall");
        assert!(stall > Duration::from_millis(200), "{stall:?}");
        assert_eq!(line.take_stall(), None);
    }
}
