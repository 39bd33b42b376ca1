//! Session and device joined by a line with faults, under simulated time.

use std::time::Duration;

use scanner_driver::protocol::{Frame, ScanPlan};
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_driver::{LinkSettings, RawColumn, RawSample, ScannerError};

use crate::device::{Device, samples_of, table_of};

pub(crate) const STEP: Duration = Duration::from_millis(5);

/// How bad the line is: the share of frames, of 1, that each mishap befalls.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mishaps {
    pub(crate) lose: f64,
    pub(crate) repeat: f64,
    pub(crate) corrupt: f64,
    pub(crate) swap: f64,
    pub(crate) garbage: f64,
}

pub(crate) struct Bench {
    pub(crate) now: Duration,
    pub(crate) session: Session,
    pub(crate) device: Device,
    pub(crate) mishaps: Mishaps,
    pub(crate) columns: Vec<RawColumn>,
    pub(crate) over: Option<Result<(), ScannerError>>,
    pub(crate) finished: Vec<(Ticket, Result<Answer, ScannerError>)>,
    pub(crate) ready: u32,
    pub(crate) lost: Option<ScannerError>,
    /// Acknowledge every column at once.
    pub(crate) acknowledge: bool,
    /// The line from the device is cut.
    pub(crate) cut: bool,
    random: Random,
    next_ticket: u64,
}

pub(crate) fn plan(columns: u32) -> ScanPlan {
    ScanPlan {
        first_table_counts: table_of(0),
        pitch_counts: 40,
        columns,
        first_angle_counts: -500,
        angle_step_counts: 25,
        samples: 93,
        exposure_us: 0,
    }
}

/// The column as the driver must hand it on.
pub(crate) fn expected(index: u32) -> RawColumn {
    let samples = samples_of(index);
    RawColumn {
        index,
        table_counts: table_of(index),
        dropouts: samples.iter().filter(|s| s.reading.no_return).count() as u32,
        samples: samples
            .iter()
            .filter(|s| !s.reading.no_return)
            .map(|s| RawSample {
                lateral_counts: s.lateral_counts,
                range_counts: s.reading.range_counts,
                intensity: s.reading.intensity,
                saturated: s.reading.saturated,
            })
            .collect(),
    }
}

impl Bench {
    pub(crate) fn new(device: Device) -> Self {
        Self::with(device, LinkSettings::default(), 1)
    }

    pub(crate) fn with(device: Device, settings: LinkSettings, seed: u64) -> Self {
        settings.validate().unwrap();
        Self {
            now: Duration::ZERO,
            session: Session::new("bench", settings, 0, Duration::ZERO),
            device,
            mishaps: Mishaps::default(),
            columns: Vec::new(),
            over: None,
            finished: Vec::new(),
            ready: 0,
            lost: None,
            acknowledge: true,
            cut: false,
            random: Random(seed),
            next_ticket: 0,
        }
    }

    /// A bench whose device has been greeted.
    pub(crate) fn ready(device: Device) -> Self {
        let mut bench = Self::new(device);
        bench.run_until("ready", |bench| bench.ready > 0);
        bench
    }

    pub(crate) fn command(&mut self, command: Command) -> Ticket {
        self.next_ticket += 1;
        let ticket = Ticket(self.next_ticket);
        self.session.command(ticket, command, self.now);
        ticket
    }

    /// Gives a command and waits for its outcome.
    pub(crate) fn run(&mut self, command: Command) -> Result<Answer, ScannerError> {
        let ticket = self.command(command);
        self.run_until("the command's end", |bench| bench.outcome(ticket).is_some());
        self.outcome(ticket).unwrap()
    }

    pub(crate) fn outcome(&self, ticket: Ticket) -> Option<Result<Answer, ScannerError>> {
        self.finished
            .iter()
            .find(|(finished, _)| *finished == ticket)
            .map(|(_, result)| result.clone())
    }

    /// Both ends, once.
    pub(crate) fn step(&mut self) {
        self.now += STEP;
        self.session.poll(self.now);
        let sent = self.session.take_output();
        // The host's frames come to harm as well: cut at delimiters, they are frames again.
        let frames: Vec<Vec<u8>> = sent
            .split(|byte| *byte == 0)
            .filter(|body| !body.is_empty())
            .map(|body| [&[0], body, &[0]].concat())
            .collect();
        for bytes in self.harm(frames) {
            self.device.receive(&bytes, self.now);
        }
        let frames = self.device.poll(self.now);
        let frames: Vec<Vec<u8>> = frames
            .iter()
            .map(|f: &Frame| f.as_bytes().to_vec())
            .collect();
        if !self.cut {
            for bytes in self.harm(frames) {
                self.session.receive(&bytes, self.now);
            }
        }
        self.events();
    }

    /// Feeds the session bytes that no device of ours sent.
    pub(crate) fn babble(&mut self, bytes: &[u8]) {
        self.session.receive(bytes, self.now);
        self.events();
    }

    pub(crate) fn events(&mut self) {
        while let Some(event) = self.session.next_event() {
            match event {
                Event::Ready(_) => self.ready += 1,
                Event::Finished(ticket, result) => self.finished.push((ticket, result)),
                Event::Column(column) => {
                    if self.acknowledge {
                        self.session.acknowledge(column.index, self.now);
                    }
                    self.columns.push(column);
                }
                Event::ScanOver(result) => {
                    assert!(self.over.is_none(), "a scan ended twice");
                    self.over = Some(result);
                }
                Event::Lost(error) => self.lost = Some(error),
            }
        }
    }

    pub(crate) fn run_for(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.step();
        }
    }

    pub(crate) fn run_until(&mut self, awaited: &str, done: impl Fn(&Self) -> bool) {
        let until = self.now + Duration::from_secs(120);
        while !done(self) {
            assert!(self.now < until, "no {awaited} in simulated minutes");
            self.step();
        }
    }

    /// Starts a scan and runs it to its end.
    pub(crate) fn scan(&mut self, columns: u32) -> Result<(), ScannerError> {
        self.run(Command::Scan(plan(columns)))?;
        self.run_until("end of the scan", |bench| bench.over.is_some());
        self.over.take().unwrap()
    }

    pub(crate) fn assert_columns(&self, count: u32) {
        assert_eq!(self.columns.len(), count as usize);
        for (index, column) in (0..).zip(&self.columns) {
            assert_eq!(*column, expected(index));
        }
    }

    fn harm(&mut self, frames: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        let mut out: Vec<Vec<u8>> = Vec::new();
        for mut frame in frames {
            if self.random.chance(self.mishaps.garbage) {
                let junk = (0..self.random.below(300)).map(|_| self.random.below(256) as u8);
                out.push(junk.collect());
            }
            if self.random.chance(self.mishaps.lose) {
                continue;
            }
            if self.random.chance(self.mishaps.corrupt) {
                let at = self.random.below(frame.len());
                frame[at] ^= 1 << self.random.below(8);
            }
            if self.random.chance(self.mishaps.repeat) {
                out.push(frame.clone());
            }
            out.push(frame);
            if out.len() > 1 && self.random.chance(self.mishaps.swap) {
                let last = out.len() - 1;
                out.swap(last, last - 1);
            }
        }
        out
    }
}

/// SplitMix64: small, seeded, good enough to place mishaps.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        (self.next() >> 11) as f64 / ((1_u64 << 53) as f64) < share
    }
}
