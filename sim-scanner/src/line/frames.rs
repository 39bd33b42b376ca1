//! What a line with buffers of its own does to frames: it cuts them, holds them back, lets
//! others overtake them, and brings them once more.

use core::time::Duration;

use super::{Direction, LineFaults, gap};
use crate::fault::Strikes;
use crate::random::{Draws, Purpose};

/// Bytes without a delimiter that are no frame, and pass as they are.
const NO_FRAME: usize = 1_024;

/// Frames that may overtake one.
const OVERTAKERS: u64 = 40;

/// Frames after which one may come once more.
const REPLAY_AFTER: u64 = 200;

/// Most frames held back: a line's buffers end somewhere.
const HELD_MAX: usize = 256;

/// Draws of the frames are apart from those of the bytes, which have the direction alone.
const STREAM: u64 = 16;

#[derive(Debug, Clone)]
pub(super) struct BadFrames {
    faults: LineFaults,
    draws: Draws,
    until_cut: u64,
    until_replay: u64,
    until_delay: u64,
    until_reorder: u64,
    /// The frame that is not yet at its end.
    begun: Vec<u8>,
    held: Vec<Held>,
    pub(super) strikes: Strikes,
}

#[derive(Debug, Clone)]
struct Held {
    frame: Vec<u8>,
    until: Until,
}

#[derive(Debug, Clone, Copy)]
enum Until {
    Time(Duration),
    /// So many more frames have passed.
    Frames(u64),
}

impl BadFrames {
    pub(super) fn new(faults: &LineFaults, direction: Direction) -> Self {
        let mut draws = Draws::keyed(faults.seed, Purpose::Line, &[STREAM + direction as u64]);
        Self {
            until_cut: gap(faults.cut, &mut draws),
            until_replay: gap(faults.replay, &mut draws),
            until_delay: gap(faults.delay, &mut draws),
            until_reorder: gap(faults.reorder, &mut draws),
            faults: *faults,
            draws,
            begun: Vec::new(),
            held: Vec::new(),
            strikes: Strikes::default(),
        }
    }

    /// Whether frames pass untouched, so that they need not be looked at.
    pub(super) fn are_good(&self) -> bool {
        let faults = &self.faults;
        [faults.cut, faults.replay, faults.delay, faults.reorder]
            .iter()
            .all(|rate| *rate <= 0.0)
    }

    pub(super) fn carry(&mut self, bytes: &[u8], now: Duration) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        self.release(
            &mut out,
            |until| matches!(until, Until::Time(time) if time <= now),
        );
        for &byte in bytes {
            self.begun.push(byte);
            let at_end = byte == 0 && self.begun.iter().any(|byte| *byte != 0);
            if at_end || self.begun.len() >= NO_FRAME {
                let frame = std::mem::take(&mut self.begun);
                self.frame(frame, now, &mut out);
            }
        }
        out
    }

    pub(super) fn due(&self) -> Option<Duration> {
        self.held
            .iter()
            .filter_map(|held| match held.until {
                Until::Time(time) => Some(time),
                Until::Frames(_) => None,
            })
            .min()
    }

    pub(super) fn forget(&mut self) {
        self.begun.clear();
        self.held.clear();
    }

    fn frame(&mut self, mut frame: Vec<u8>, now: Duration, out: &mut Vec<u8>) {
        if self.happens("cut", |frames| &mut frames.until_cut, self.faults.cut) {
            let length = self.draws.bits() % frame.len().max(1) as u64;
            frame.truncate(length as usize);
        }
        if self.happens(
            "replay",
            |frames| &mut frames.until_replay,
            self.faults.replay,
        ) {
            let later = 1 + self.draws.bits() % REPLAY_AFTER;
            self.hold(frame.clone(), Until::Frames(later));
        }
        let late = if self.happens("delay", |frames| &mut frames.until_delay, self.faults.delay) {
            let wait = self.faults.delay_time.mul_f64(self.draws.uniform());
            Some(Until::Time(now + wait))
        } else if self.happens(
            "reorder",
            |frames| &mut frames.until_reorder,
            self.faults.reorder,
        ) {
            Some(Until::Frames(1 + self.draws.bits() % OVERTAKERS))
        } else {
            None
        };
        match late {
            Some(until) => self.hold(frame, until),
            None => out.extend(frame),
        }
        for held in &mut self.held {
            if let Until::Frames(left) = &mut held.until {
                *left = left.saturating_sub(1);
            }
        }
        self.release(out, |until| matches!(until, Until::Frames(0)));
    }

    fn hold(&mut self, frame: Vec<u8>, until: Until) {
        if self.held.len() < HELD_MAX {
            self.held.push(Held { frame, until });
        }
    }

    fn release(&mut self, out: &mut Vec<u8>, due: impl Fn(Until) -> bool) {
        self.held.retain(|held| {
            let stays = !due(held.until);
            if !stays {
                out.extend(&held.frame);
            }
            stays
        });
    }

    fn happens(
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

#[cfg(test)]
mod tests {
    use super::super::BadLine;
    use super::*;

    fn frame(number: u8) -> Vec<u8> {
        vec![0, 1 + number % 250, 7, 7, 0]
    }

    fn carried(faults: LineFaults, frames: u8) -> Vec<Vec<u8>> {
        let mut line = BadLine::new(&faults, Direction::ToHost);
        let mut out = Vec::new();
        for number in 0..frames {
            let now = Duration::from_millis(u64::from(number) * 10);
            // In pieces that do not care for frames.
            for piece in frame(number).chunks(2) {
                out.extend(line.carry(piece, now));
            }
        }
        out.extend(line.carry(&[], Duration::from_secs(60)));
        out.split(|byte| *byte == 0)
            .filter(|body| !body.is_empty())
            .map(<[u8]>::to_vec)
            .collect()
    }

    #[test]
    fn late_frames_come_all_and_out_of_order() {
        let faults = LineFaults {
            delay: 0.2,
            seed: 3,
            ..LineFaults::default()
        };
        let got = carried(faults, 200);
        assert_eq!(got.len(), 200);
        assert!(got.windows(2).any(|pair| pair[0] > pair[1]));
        let mut sorted = got.clone();
        sorted.sort();
        assert!(sorted.iter().zip(0..).all(|(got, n)| got[0] == frame(n)[1]));
    }

    #[test]
    fn overtaken_and_repeated_frames_are_whole() {
        let faults = LineFaults {
            reorder: 0.1,
            replay: 0.1,
            seed: 9,
            ..LineFaults::default()
        };
        let got = carried(faults, 250);
        assert!(got.len() > 255, "{}", got.len());
        assert!(got.iter().all(|body| body.len() == 3));
        assert!(got.windows(2).any(|pair| pair[0] > pair[1]));
    }

    #[test]
    fn a_cut_frame_is_shorter_and_a_cut_cable_loses_what_was_held() {
        let faults = LineFaults {
            cut: 0.5,
            seed: 2,
            ..LineFaults::default()
        };
        assert!(carried(faults, 100).iter().any(|body| body.len() != 3));
        let faults = LineFaults {
            delay: 0.5,
            seed: 2,
            ..LineFaults::default()
        };
        let mut line = BadLine::new(&faults, Direction::ToHost);
        let passed: usize = (0..100)
            .map(|n| line.carry(&frame(n), Duration::ZERO).len())
            .sum();
        assert!(line.due().is_some());
        line.cut_off();
        assert_eq!(line.due(), None);
        assert_eq!(line.carry(&[], Duration::from_secs(60)), Vec::<u8>::new());
        assert!(passed < 500);
    }
}
