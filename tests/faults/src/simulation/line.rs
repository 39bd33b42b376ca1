//! The line: both directions, each with its faults and a millisecond of delay.

use std::collections::VecDeque;
use std::time::Duration;

use sim_scanner::fault::Strikes;
use sim_scanner::line::{BadLine, Direction, LineFaults};

/// How long bytes are under way.
const DELAY: Duration = Duration::from_millis(1);

/// Most bytes under way: a port's buffer ends somewhere, and what is beyond is lost.
const BUFFER: usize = 256 * 1024;

pub(super) struct Line {
    to_host: Way,
    to_device: Way,
}

struct Way {
    line: BadLine,
    under_way: VecDeque<(Duration, Vec<u8>)>,
    bytes: usize,
    silent_until: Duration,
}

impl Line {
    pub(super) fn new(faults: &LineFaults) -> Self {
        Self {
            to_host: Way::new(faults, Direction::ToHost),
            to_device: Way::new(faults, Direction::ToDevice),
        }
    }

    pub(super) fn device_says(&mut self, bytes: &[u8], now: Duration) {
        self.to_host.put(bytes, now);
    }

    pub(super) fn host_says(&mut self, bytes: &[u8], now: Duration) {
        self.to_device.put(bytes, now);
    }

    pub(super) fn for_host(&mut self, now: Duration) -> Vec<u8> {
        self.to_host.take(now)
    }

    pub(super) fn for_device(&mut self, now: Duration) -> Vec<u8> {
        self.to_device.take(now)
    }

    pub(super) fn due_for_host(&self) -> Option<Duration> {
        self.to_host.due()
    }

    pub(super) fn due_for_device(&self) -> Option<Duration> {
        self.to_device.due()
    }

    /// How often which fault has struck, either way.
    pub(super) fn strikes(&self) -> Strikes {
        let mut strikes = self.to_host.line.strikes();
        strikes.add(&self.to_device.line.strikes());
        strikes
    }

    /// The cable is out: all that is under way is lost.
    pub(super) fn cut_off(&mut self) {
        self.to_host.cut_off();
        self.to_device.cut_off();
    }

    /// The host closes its port: what waits for it is lost, what it has sent is not.
    pub(super) fn hang_up(&mut self) {
        self.to_host.under_way.clear();
        self.to_host.bytes = 0;
    }
}

impl Way {
    fn new(faults: &LineFaults, direction: Direction) -> Self {
        Self {
            line: BadLine::new(faults, direction),
            under_way: VecDeque::new(),
            bytes: 0,
            silent_until: Duration::ZERO,
        }
    }

    fn put(&mut self, bytes: &[u8], now: Duration) {
        let carried = self.line.carry(bytes, now);
        if let Some(stall) = self.line.take_stall() {
            self.silent_until = self.silent_until.max(now) + stall;
        }
        if !carried.is_empty() && self.bytes + carried.len() <= BUFFER {
            self.bytes += carried.len();
            self.under_way.push_back((now + DELAY, carried));
        }
    }

    fn take(&mut self, now: Duration) -> Vec<u8> {
        // What was held back on the line comes out of it by itself.
        if self.line.due().is_some_and(|due| due <= now) {
            self.put(&[], now);
        }
        let mut out = Vec::new();
        if now < self.silent_until {
            return out;
        }
        while self.under_way.front().is_some_and(|(time, _)| *time <= now) {
            let bytes = self.under_way.pop_front().map(|(_, bytes)| bytes);
            out.extend(bytes.unwrap_or_default());
        }
        self.bytes -= out.len();
        out
    }

    fn due(&self) -> Option<Duration> {
        let first = self
            .under_way
            .front()
            .map(|(time, _)| (*time).max(self.silent_until));
        first.into_iter().chain(self.line.due()).min()
    }

    fn cut_off(&mut self) {
        self.line.cut_off();
        self.under_way.clear();
        self.bytes = 0;
    }
}
