//! One scan, from the first connection to some seconds after its end.

mod clock;
mod guard;
mod host;
mod line;
mod surroundings;

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Result, ensure};
use scanner_driver::recovery::Recovery;
use scanner_driver::session::{Session, Ticket};
use scanner_driver::{LinkSettings, Pause, ResumeSettings, ScannerError};
use scanner_protocol::Identity;
use sim_scanner::Vec3;
use sim_scanner::device::{Device, DeviceSettings, Event};
use sim_scanner::fault::Strikes;

use crate::conditions::{Conditions, Outcome};
use crate::journal::Journal;
use crate::scene::{self, Dice};
use clock::HostClock;
use guard::Guard;
use line::Line;

/// A scan that has not ended by then hangs: longer than all sleeps and leaps of a scan.
const TOO_LONG: Duration = Duration::from_secs(7 * 24 * 3600);

/// After so many turns without an end it spins.
const TOO_MANY_TURNS: u64 = 20_000_000;

/// Columns per second.
const LINE_RATE_HZ: f64 = 50.0;

/// Runs a scan.
///
/// # Errors
/// What must never be, in words: a hang, a laser left on, columns out of order.
pub fn run(conditions: &Conditions) -> Result<Outcome> {
    let mut simulation = Simulation::new(conditions)?;
    while !simulation.is_done() {
        simulation.turn()?;
    }
    simulation.watch_the_end()?;
    simulation.outcome()
}

#[derive(Debug, PartialEq, Eq, Clone, Copy)]
enum Stage {
    Home(Option<Ticket>),
    Scan(Option<Ticket>),
    Columns,
    Done,
}

struct Simulation {
    now: Duration,
    turns: u64,
    conditions: Conditions,
    dice: Dice,
    device: Device,
    device_wake: Option<Duration>,
    line: Line,
    settings: LinkSettings,
    clock: HostClock,
    /// Time that will have passed, for all, when anything is looked at next.
    leap: Duration,
    session: Option<Session>,
    /// The first tag of the next session.
    next_tag: u16,
    /// By the host's clock.
    connect_at: Duration,
    identity: Option<Box<Identity>>,
    stage: Stage,
    starts: u32,
    tickets: u64,
    begun: Duration,
    ended: Duration,
    scan: Option<Recovery>,
    journal: Option<Journal>,
    columns: u32,
    /// Columns that will be on disk, and when: in order, as in a journal.
    disk: Vec<(Duration, u32)>,
    disk_dice: Dice,
    person_at: Option<Duration>,
    /// When somebody pauses the scan.
    pause_at: Option<Duration>,
    pause_dice: Dice,
    /// Since when the scan waits for a person.
    asked_since: Option<Duration>,
    /// How often the person has come since the last new column.
    visits: u32,
    asleep_until: Duration,
    guard: Guard,
    strikes: Strikes,
    attended: Vec<Pause>,
    pauses: u32,
    told: Vec<(Duration, String)>,
    error: Option<ScannerError>,
    complete: bool,
    samples: usize,
    /// Where the object stood when each column was last measured.
    stood_mm: BTreeMap<u32, Vec3>,
    /// Where the object stood when it was first seen.
    stands_mm: Vec3,
    moved_before_it_was_seen: bool,
}

impl Simulation {
    fn new(conditions: &Conditions) -> Result<Self> {
        let source = scene::source(conditions.seed)?;
        let settings = DeviceSettings {
            line_rate_hz: Some(LINE_RATE_HZ),
            feels_the_plug: conditions.feels_the_plug,
            mishaps: conditions.faults.device,
            ..DeviceSettings::default()
        };
        let now = Duration::from_secs(1);
        Ok(Self {
            now,
            turns: 0,
            conditions: *conditions,
            dice: Dice::new(conditions.seed, 2),
            device: Device::new(source, settings, conditions.seed, now),
            device_wake: Some(now),
            line: Line::new(&conditions.faults.line),
            settings: LinkSettings {
                resume: Some(ResumeSettings::default()),
                ..LinkSettings::default()
            },
            clock: HostClock::default(),
            leap: Duration::ZERO,
            session: None,
            next_tag: 0,
            connect_at: now,
            identity: None,
            stage: Stage::Home(None),
            starts: 0,
            tickets: 0,
            begun: now,
            ended: now,
            scan: None,
            journal: Some(Journal::new()?),
            columns: 0,
            disk: Vec::new(),
            disk_dice: Dice::new(conditions.seed, 3),
            asked_since: None,
            person_at: None,
            pause_at: None,
            pause_dice: Dice::new(conditions.seed, 4),
            visits: 0,
            asleep_until: Duration::ZERO,
            guard: Guard::default(),
            strikes: Strikes::default(),
            attended: Vec::new(),
            pauses: 0,
            told: Vec::new(),
            error: None,
            complete: false,
            samples: 0,
            stood_mm: BTreeMap::new(),
            stands_mm: Vec3::default(),
            moved_before_it_was_seen: false,
        })
    }

    fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// Everything that is due now, and then on to what is due next.
    fn turn(&mut self) -> Result<()> {
        self.turns += 1;
        let seed = self.conditions.seed;
        ensure!(
            self.now < TOO_LONG,
            "seed {seed}: no end within {TOO_LONG:?}; told: {:?}",
            self.told.last()
        );
        ensure!(self.turns < TOO_MANY_TURNS, "seed {seed}: it spins");
        self.device_turn();
        if self.now >= self.asleep_until {
            self.host_turn()?;
        }
        self.watch_the_laser()?;
        let next = self.next_time().max(self.now + Duration::from_micros(100));
        self.now = next.max(self.now + std::mem::take(&mut self.leap));
        Ok(())
    }

    fn device_turn(&mut self) {
        let now = self.now;
        if self.device.is_unplugged() {
            self.line.cut_off();
        }
        let bytes = self.line.for_device(now);
        if !bytes.is_empty() {
            self.device.receive(&bytes, now);
        }
        let (before, stood_mm) = (self.device.snapshot(now), self.part_offset_mm());
        let poll = self.device.poll(now);
        // Whatever moves the object does so once a column is measured.
        for column in before.columns_sent..self.device.snapshot(now).columns_sent {
            self.stood_mm.insert(column, stood_mm);
        }
        self.device_wake = poll.wake;
        if !self.device.is_unplugged() {
            self.line.device_says(&poll.bytes, now);
        }
    }

    /// When something happens next.
    fn next_time(&self) -> Duration {
        let mut times: Vec<Option<Duration>> = vec![self.device_wake, self.line.due_for_device()];
        if self.now >= self.asleep_until {
            times.extend(self.host_due());
        } else {
            times.push(Some(self.asleep_until));
        }
        let furthest = self.now + Duration::from_secs(1);
        times
            .into_iter()
            .flatten()
            .min()
            .unwrap_or(furthest)
            .min(furthest)
    }

    fn outcome(mut self) -> Result<Outcome> {
        let measured = self
            .device
            .events()
            .iter()
            .filter(|event| matches!(event, Event::ColumnSent(_)))
            .count();
        self.strikes.add(self.device.strikes());
        self.strikes.add(&self.line.strikes());
        let journal = self.journal.take().filter(|_| self.complete);
        Ok(Outcome {
            journal: journal.map(Journal::finish).transpose()?,
            error: self.error,
            moved_before_it_was_seen: self.moved_before_it_was_seen,
            strikes: self.strikes,
            attended: self.attended,
            pauses: self.pauses,
            told: self.told,
            measured: measured as u64,
            columns: self.columns,
            took: self.ended - self.begun,
        })
    }
}
