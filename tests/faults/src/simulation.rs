//! One scan, from the first connection to some seconds after its end.

mod line;

use std::time::Duration;

use anyhow::{Result, bail, ensure};
use scanner_driver::limits::PROOF_SAMPLES;
use scanner_driver::recovery::{Progress, Recovery};
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_driver::{LinkSettings, Pause, ResumeSettings, ScannerError};
use scanner_protocol::{Activity, Identity, ScanPlan};
use sim_scanner::Vec3;
use sim_scanner::device::{Device, DeviceSettings};
use sim_scanner::fault::FaultSpec;
use sim_scanner::source::Source;

use crate::journal::Journal;
use crate::scene::{self, Dice};
use line::Line;

/// What a scan is to suffer.
#[derive(Debug, Clone, Copy)]
pub struct Conditions {
    /// Seed of all that is drawn.
    pub seed: u64,
    /// Faults of line and device.
    pub faults: FaultSpec,
    /// Rate per column at which the host sleeps for up to 20 s.
    pub host_sleep: f64,
    /// The person at first lets the scan go on without having put anything right.
    pub careless: bool,
    /// Both ends see at once that the cable is out, as on USB; otherwise bytes are lost.
    pub feels_the_plug: bool,
}

/// How a scan went.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The journal, if every column is in it.
    pub journal: Option<Vec<u8>>,
    /// Why it ended otherwise.
    pub error: Option<ScannerError>,
    /// The object was moved before enough of it was measured for anybody to notice; it was
    /// measured where it stood then.
    pub moved_before_it_was_seen: bool,
    /// The pauses that a person had to end.
    pub attended: Vec<Pause>,
    /// All pauses, by whoever ended them.
    pub pauses: u32,
    /// What was told of pauses, and when since the start.
    pub told: Vec<(Duration, String)>,
    /// Columns measured, those measured again included.
    pub measured: u64,
    /// Columns of the scan.
    pub columns: u32,
    /// Simulated time from the scan's start to its end.
    pub took: Duration,
}

/// A scan that has not ended by then hangs.
const TOO_LONG: Duration = Duration::from_secs(6 * 3600);

/// After so many turns without an end it spins.
const TOO_MANY_TURNS: u64 = 20_000_000;

/// How long a person takes to look.
const PERSON: Duration = Duration::from_secs(30);

/// How long the device is watched after the scan's end: longer than its dead-man time.
const AFTERWARDS: Duration = Duration::from_secs(10);

/// How long a column takes to the disk, mostly.
const DISK: Duration = Duration::from_millis(4);

/// Share of columns on which the disk is slow, and how long it takes for these at most.
const SLOW_DISK: f64 = 0.1;
const SLOWEST_DISK: Duration = Duration::from_secs(2);

/// Columns per second.
const LINE_RATE_HZ: f64 = 50.0;

/// The service's way to begin a scan: home, then scan, and anew so often if the trouble may
/// pass.
const STARTS: u32 = 3;

/// Runs a scan.
///
/// # Errors
/// What must never be, in words: a hang, a laser left on, columns out of order.
pub fn run(conditions: &Conditions) -> Result<Outcome> {
    let mut simulation = Simulation::new(conditions)?;
    while !simulation.is_done() {
        simulation.turn()?;
    }
    simulation.watch_the_laser()?;
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
    session: Option<Session>,
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
    /// Since when the scan waits for a person.
    asked_since: Option<Duration>,
    asleep_until: Duration,
    attended: Vec<Pause>,
    pauses: u32,
    told: Vec<(Duration, String)>,
    error: Option<ScannerError>,
    complete: bool,
    samples: usize,
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
            session: None,
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
            asleep_until: Duration::ZERO,
            attended: Vec::new(),
            pauses: 0,
            told: Vec::new(),
            error: None,
            complete: false,
            samples: 0,
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
            "seed {seed}: no end within {TOO_LONG:?}"
        );
        ensure!(self.turns < TOO_MANY_TURNS, "seed {seed}: it spins");
        self.device_turn();
        if self.now >= self.asleep_until {
            self.host_turn()?;
        }
        self.watch_the_pause()?;
        let next = self.next_time();
        self.now = next.max(self.now + Duration::from_micros(100));
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
        let poll = self.device.poll(now);
        self.device_wake = poll.wake;
        if !self.device.is_unplugged() {
            self.line.device_says(&poll.bytes, now);
        }
    }

    fn host_turn(&mut self) -> Result<()> {
        let now = self.now;
        let pulled = self.device.is_unplugged() && self.conditions.feels_the_plug;
        match &mut self.session {
            None if now >= self.connect_at && pulled => {
                self.connect_at = now + self.settings.reconnect_first;
            }
            None if now >= self.connect_at => {
                self.session = Some(Session::new("line", self.settings.clone(), now));
            }
            None => {}
            Some(session) => {
                if pulled {
                    session.lose(ScannerError::LostConnection {
                        port: "line".into(),
                        why: "unplugged".into(),
                    });
                }
                let bytes = self.line.for_host(now);
                if bytes.is_empty() {
                    session.poll(now);
                } else {
                    session.receive(&bytes, now);
                }
            }
        }
        self.disk();
        self.person();
        self.begin();
        self.events()?;
        if let Some(scan) = &mut self.scan {
            scan.poll(self.session.as_mut(), now);
        }
        self.progress()?;
        if let Some(session) = &mut self.session {
            let bytes = session.take_output();
            if !self.device.is_unplugged() {
                self.line.host_says(&bytes, now);
            }
        }
        Ok(())
    }

    /// Columns reach the disk, and are acknowledged.
    fn disk(&mut self) {
        let now = self.now;
        let (done, rest) = self.disk.iter().partition(|(time, _)| *time <= now);
        self.disk = rest;
        let done: Vec<(Duration, u32)> = done;
        for (_, column) in done {
            if let Some(scan) = &mut self.scan {
                scan.acknowledge(column);
            }
            if let Some(session) = &mut self.session {
                session.acknowledge(column, now);
            }
        }
    }

    fn disk_takes(&mut self) -> Duration {
        let slow = self.disk_dice.uniform() < SLOW_DISK;
        let share = self.disk_dice.uniform();
        if slow {
            SLOWEST_DISK.mul_f64(share)
        } else {
            DISK
        }
    }

    /// A person comes, looks, puts right what is wrong, and lets the scan go on.
    fn person(&mut self) {
        if self.person_at.is_none_or(|at| self.now < at) {
            return;
        }
        self.person_at = None;
        if !std::mem::take(&mut self.conditions.careless) {
            let back = self.stands_mm - self.part_offset_mm();
            self.device.move_part(back);
        }
        if let Some(scan) = &mut self.scan {
            // It may have gone on by itself meanwhile.
            let _ = scan.resume(self.now);
        }
    }

    /// The service's way to begin a scan.
    fn begin(&mut self) {
        let now = self.now;
        let Some(session) = self.session.as_mut().filter(|s| s.is_ready()) else {
            return;
        };
        let command = match (self.stage, &self.identity) {
            (Stage::Home(None), _) => Command::Home,
            (Stage::Scan(None), Some(identity)) => Command::Scan(identity.limits.proposed),
            _ => return,
        };
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        self.stage = match self.stage {
            Stage::Home(_) => Stage::Home(Some(ticket)),
            _ => Stage::Scan(Some(ticket)),
        };
        session.command(ticket, command, now);
    }

    fn events(&mut self) -> Result<()> {
        while let Some(event) = self.session.as_mut().and_then(Session::next_event) {
            let event = match &mut self.scan {
                Some(scan) => scan.event(event, self.now),
                None => Some(event),
            };
            match event {
                Some(Event::Ready(identity)) => self.identity = Some(identity),
                Some(Event::Finished(ticket, result)) => self.finished(ticket, result)?,
                Some(Event::Lost(_)) => {
                    self.session = None;
                    self.line.hang_up();
                    self.connect_at = self.now + self.settings.reconnect_first;
                }
                Some(Event::Column(_) | Event::ScanOver(_)) | None => {}
            }
        }
        Ok(())
    }

    fn finished(&mut self, ticket: Ticket, result: Result<Answer, ScannerError>) -> Result<()> {
        match (self.stage, result) {
            (Stage::Home(Some(ours)), Ok(_)) if ours == ticket => self.stage = Stage::Scan(None),
            (Stage::Scan(Some(ours)), Ok(Answer::Scan(info))) if ours == ticket => {
                let Some(identity) = self.identity.clone() else {
                    bail!("a scan without a device");
                };
                let plan: ScanPlan = identity.limits.proposed;
                self.columns = info.columns;
                self.begun = self.now;
                self.stage = Stage::Columns;
                self.scan = Some(Recovery::begun(
                    self.settings.resume.clone(),
                    identity,
                    plan,
                    info,
                    self.now,
                ));
            }
            (Stage::Home(Some(ours)) | Stage::Scan(Some(ours)), Err(error)) if ours == ticket => {
                self.starts += 1;
                if self.starts >= STARTS || !error.may_pass() {
                    self.end(Err(error));
                } else {
                    self.stage = Stage::Home(None);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn progress(&mut self) -> Result<()> {
        while let Some(progress) = self.scan.as_mut().and_then(Recovery::next_progress) {
            match progress {
                Progress::Column(column) => {
                    self.samples += column.samples.len();
                    let safe = self.now + self.disk_takes();
                    let before = self.disk.iter().map(|(time, _)| *time).max();
                    self.disk
                        .push((before.max(Some(safe)).unwrap_or(safe), column.index));
                    if let Some(journal) = &mut self.journal {
                        journal.append(column)?;
                    }
                    if self.dice.uniform() < self.conditions.host_sleep {
                        let time = Duration::from_secs_f64(20.0 * self.dice.uniform());
                        self.asleep_until = self.now + time;
                    }
                }
                Progress::Paused(pause) => {
                    let words = format!(
                        "after {} columns: {pause} [the object stands at {:?}]",
                        pause.columns,
                        self.part_offset_mm()
                    );
                    self.told.push((self.now, words));
                    let asked = self.asked_since.unwrap_or(self.now);
                    self.asked_since = pause.needs_person.then_some(asked);
                    if pause.needs_person {
                        self.person_at = Some(self.now + PERSON);
                        self.attended.push(pause);
                    }
                    self.pauses += 1;
                }
                Progress::Resumed => {
                    self.person_at = None;
                    let words = format!("goes on [{:?}]", self.part_offset_mm());
                    self.told.push((self.now, words));
                    if self.samples < PROOF_SAMPLES {
                        self.stands_mm = self.part_offset_mm();
                        self.moved_before_it_was_seen = self.stands_mm.length() > 0.0;
                    }
                }
                Progress::Over(result) => self.end(result),
            }
        }
        Ok(())
    }

    fn part_offset_mm(&self) -> Vec3 {
        match self.device.source() {
            Source::Simulated { scanner, .. } => scanner.part_offset_mm,
            Source::Replay(_) => Vec3::default(),
        }
    }

    fn end(&mut self, result: Result<(), ScannerError>) {
        self.complete = result.is_ok();
        self.error = result.err();
        self.ended = self.now;
        self.stage = Stage::Done;
    }

    /// When something happens next.
    fn next_time(&self) -> Duration {
        let mut times: Vec<Option<Duration>> = vec![self.device_wake, self.line.due_for_device()];
        if self.now >= self.asleep_until {
            times.push(self.line.due_for_host());
            times.push(self.session.as_ref().and_then(Session::deadline));
            if self.session.is_none() {
                times.push(Some(self.connect_at));
            }
            times.push(self.scan.as_ref().and_then(Recovery::deadline));
            times.push(self.person_at);
            times.extend(self.disk.iter().map(|(time, _)| Some(*time)));
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

    /// While a person is waited for the laser is off, at the latest after the dead-man time.
    fn watch_the_pause(&self) -> Result<()> {
        let waits_long = self
            .asked_since
            .is_some_and(|since| self.now > since + self.settings.dead_man);
        let seed = self.conditions.seed;
        ensure!(
            !waits_long || !self.device.snapshot(self.now).laser_on,
            "seed {seed}: the laser is on while a person is waited for: {:?}",
            self.told
        );
        Ok(())
    }

    /// The laser is off some time after the end, whatever else is, and a complete scan is
    /// closed.
    fn watch_the_laser(&mut self) -> Result<()> {
        let until = self.now.max(self.asleep_until) + AFTERWARDS;
        while self.now < until {
            self.turn()?;
        }
        let snapshot = self.device.snapshot(self.now);
        let seed = self.conditions.seed;
        ensure!(
            !snapshot.laser_on,
            "seed {seed}: the laser is on after the scan"
        );
        let busy = matches!(snapshot.activity, Activity::Scanning | Activity::Waiting);
        ensure!(!busy, "seed {seed}: the device scans on: {snapshot:?}");
        ensure!(
            !self.complete || snapshot.columns_sent == 0,
            "seed {seed}: the scan is never closed: {snapshot:?}"
        );
        Ok(())
    }

    fn outcome(mut self) -> Result<Outcome> {
        let measured = self
            .device
            .events()
            .iter()
            .filter(|event| matches!(event, sim_scanner::device::Event::ColumnSent(_)))
            .count();
        let journal = self.journal.take().filter(|_| self.complete);
        Ok(Outcome {
            journal: journal.map(Journal::finish).transpose()?,
            error: self.error,
            moved_before_it_was_seen: self.moved_before_it_was_seen,
            attended: self.attended,
            pauses: self.pauses,
            told: self.told,
            measured: measured as u64,
            columns: self.columns,
            took: self.ended - self.begun,
        })
    }
}
