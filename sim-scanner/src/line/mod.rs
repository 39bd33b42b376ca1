//! A bad line between device and host: seeded faults on the bytes and frames that pass.
//!
//! Faults are written as `key=value` pairs joined by commas; see [`crate::fault`] for the keys.

mod frames;

use core::time::Duration;

use crate::fault::Strikes;
use crate::random::{Draws, Purpose};
use frames::BadFrames;

/// Rates of faults; 0 for none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFaults {
    /// Rate of turned bits, per bit.
    pub flip: f64,
    /// Rate of lost bytes, per byte.
    pub lose: f64,
    /// Rate of doubled bytes, per byte.
    pub double: f64,
    /// Rate of bursts of garbage, per byte.
    pub garbage: f64,
    /// Rate of floods of garbage, per byte.
    pub flood: f64,
    /// Rate of stalls, per byte.
    pub stall: f64,
    /// Length of a stall.
    pub stall_time: Duration,
    /// Rate of frames cut off somewhere, per frame.
    pub cut: f64,
    /// Rate of frames that come once more, much later, per frame.
    pub replay: f64,
    /// Rate of frames that come late, per frame.
    pub delay: f64,
    /// Longest such delay.
    pub delay_time: Duration,
    /// Rate of frames that others overtake, per frame: so that fragments and whole columns
    /// come out of order.
    pub reorder: f64,
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
            double: 0.0,
            garbage: 0.0,
            flood: 0.0,
            stall: 0.0,
            stall_time: Duration::from_millis(200),
            cut: 0.0,
            replay: 0.0,
            delay: 0.0,
            delay_time: Duration::from_millis(500),
            reorder: 0.0,
            to_host: true,
            to_device: true,
            seed: 0,
        }
    }
}

/// Most bytes of a burst of garbage.
const GARBAGE_MAX: u64 = 64;

/// Fewest and most bytes of a flood.
const FLOOD: (u64, u64) = (1_024, 16_384);

/// One direction of a bad line.
#[derive(Debug, Clone)]
pub struct BadLine {
    faults: LineFaults,
    draws: Draws,
    frames: BadFrames,
    /// Places left until the next fault of each sort.
    until_flip: u64,
    until_lose: u64,
    until_double: u64,
    until_garbage: u64,
    until_flood: u64,
    until_stall: u64,
    stalls: u32,
    strikes: Strikes,
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
            until_double: gap(faults.double, &mut draws),
            until_garbage: gap(faults.garbage, &mut draws),
            until_flood: gap(faults.flood, &mut draws),
            until_stall: gap(faults.stall, &mut draws),
            stalls: 0,
            strikes: Strikes::default(),
            frames: BadFrames::new(&faults, direction),
            faults,
            draws,
        }
    }

    /// What comes out at the other end when these bytes are put in; what was held back until
    /// this time comes as well.
    pub fn carry(&mut self, bytes: &[u8], now: Duration) -> Vec<u8> {
        if self.frames.are_good() {
            return self.spoil(bytes);
        }
        let passed = self.frames.carry(bytes, now);
        self.spoil(&passed)
    }

    /// When something held back is due.
    #[must_use]
    pub fn due(&self) -> Option<Duration> {
        self.frames.due()
    }

    /// How often which fault has struck so far.
    #[must_use]
    pub fn strikes(&self) -> Strikes {
        let mut strikes = self.strikes.clone();
        strikes.add(&self.frames.strikes);
        strikes
    }

    /// Loses all that is under way, as when the cable is pulled.
    pub fn cut_off(&mut self) {
        self.frames.forget();
        self.stalls = 0;
    }

    fn spoil(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            let mut byte = byte;
            while self.until_flip < 8 {
                self.strikes.note("flip");
                byte ^= 1 << self.until_flip;
                self.until_flip = self
                    .until_flip
                    .saturating_add(1)
                    .saturating_add(gap(self.faults.flip, &mut self.draws));
            }
            self.until_flip -= 8;
            if self.strikes_now(
                "garbage",
                |line| &mut line.until_garbage,
                self.faults.garbage,
            ) {
                let length = 1 + self.draws.bits() % GARBAGE_MAX;
                self.noise(length, &mut out);
            }
            if self.strikes_now("flood", |line| &mut line.until_flood, self.faults.flood) {
                let length = FLOOD.0 + self.draws.bits() % (FLOOD.1 - FLOOD.0);
                self.noise(length, &mut out);
            }
            if self.strikes_now("stall", |line| &mut line.until_stall, self.faults.stall) {
                self.stalls += 1;
            }
            if !self.strikes_now("lose", |line| &mut line.until_lose, self.faults.lose) {
                out.push(byte);
            }
            if self.strikes_now("double", |line| &mut line.until_double, self.faults.double) {
                out.push(byte);
            }
        }
        out
    }

    fn noise(&mut self, length: u64, out: &mut Vec<u8>) {
        out.extend((0..length).map(|_| self.draws.bits() as u8));
    }

    /// How long nothing may pass from now on: the stalls met since it was last asked.
    pub fn take_stall(&mut self) -> Option<Duration> {
        let stalls = core::mem::take(&mut self.stalls);
        (stalls > 0).then(|| self.faults.stall_time * stalls)
    }

    fn strikes_now(
        &mut self,
        key: &'static str,
        until: impl Fn(&mut Self) -> &mut u64,
        rate: f64,
    ) -> bool {
        let left = *until(self);
        if left > 0 {
            *until(self) = left - 1;
            return false;
        }
        self.strikes.note(key);
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
    use crate::fault::FaultSpec;

    fn line_faults(text: &str) -> LineFaults {
        text.parse::<FaultSpec>().expect("well formed").line
    }

    #[test]
    fn faults_come_at_their_rates_and_the_same_for_a_seed() {
        let faults = line_faults("flip=1e-3,lose=5e-3,seed=3");
        let sent = vec![0_u8; 200_000];
        let mut line = BadLine::new(&faults, Direction::ToHost);
        let got = line.carry(&sent, Duration::ZERO);
        let lost = sent.len() - got.len();
        assert!((900..1100).contains(&lost), "{lost}");
        let flipped: u32 = got.iter().map(|byte| byte.count_ones()).sum();
        assert!((1450..1750).contains(&flipped), "{flipped}");
        let strikes = line.strikes();
        assert_eq!(strikes.of("lose"), lost as u64);
        // A byte that was lost may have been turned over before.
        assert!((u64::from(flipped)..1750).contains(&strikes.of("flip")));
        assert_eq!(strikes.total(), strikes.of("lose") + strikes.of("flip"));
        // The same whatever the portions.
        let mut again = BadLine::new(&faults, Direction::ToHost);
        let pieces: Vec<u8> = sent
            .chunks(777)
            .flat_map(|c| again.carry(c, Duration::ZERO))
            .collect();
        assert_eq!(got, pieces);
        let other = BadLine::new(&faults, Direction::ToDevice).carry(&sent, Duration::ZERO);
        assert_ne!(got, other);
    }

    #[test]
    fn a_good_line_changes_nothing() {
        let mut line = BadLine::new(&LineFaults::default(), Direction::ToHost);
        let sent: Vec<u8> = (0..=255).collect();
        assert_eq!(line.carry(&sent, Duration::ZERO), sent);
        assert_eq!(line.take_stall(), None);
        assert_eq!(line.strikes().total(), 0);
    }

    #[test]
    fn stalls_add_up() {
        let faults = line_faults("stall=0.5,stall-ms=10");
        let mut line = BadLine::new(&faults, Direction::ToHost);
        line.carry(&[0; 100], Duration::ZERO);
        let stall = line.take_stall().expect("half of the bytes stall");
        assert!(stall > Duration::from_millis(200), "{stall:?}");
        assert_eq!(line.take_stall(), None);
    }
}
