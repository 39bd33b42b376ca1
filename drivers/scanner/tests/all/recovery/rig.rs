//! A recovery, its session and a device, under simulated time.

use std::time::Duration;

use scanner_driver::protocol::commands::Continue;
use scanner_driver::protocol::{Decoder, Faults, Message};
use scanner_driver::recovery::{ColumnSource, InterruptedScan, Progress, Recovery};
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_driver::{LinkSettings, Pause, RawColumn, ResumeSettings, ScannerError};

use crate::bench::{STEP, expected, plan};
use crate::device::Device;

pub(super) const COLUMNS: u32 = 400;
pub(super) const MINUTE: Duration = Duration::from_secs(60);

/// What happens to the device at an opportune moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mishap {
    None,
    /// The table stalls whenever a scan has begun.
    StallsAlways,
    /// The door is opened and closed just before the scan is taken up.
    DoorBeforeContinue,
}

pub(super) struct Rig {
    pub(super) now: Duration,
    pub(super) device: Device,
    pub(super) session: Option<Session>,
    pub(super) plugged: bool,
    pub(super) scan: Recovery,
    pub(super) columns: u32,
    /// How often it has gone on after a pause.
    pub(super) resumed: u32,
    pub(super) told: Vec<Pause>,
    pub(super) over: Option<Result<(), ScannerError>>,
    pub(super) mishap: Mishap,
    /// The scan as a program finds it that begins anew.
    kept: InterruptedScan,
    /// The laser has been on since this was last set to `false`.
    pub(super) laser_seen: bool,
}

impl Rig {
    /// The device has accepted a scan.
    pub(super) fn before_any_column() -> Self {
        let mut device = Device::homed();
        let mut now = Duration::ZERO;
        let mut session = Session::new("bench", settings(), 0, now);
        let (mut identity, mut begun) = (None, None);
        while begun.is_none() {
            now += STEP;
            exchange(&mut session, &mut device, now);
            // Columns may follow at once: they are the recovery's.
            while begun.is_none()
                && let Some(event) = session.next_event()
            {
                match event {
                    Event::Ready(ready) => {
                        identity = Some(ready);
                        session.command(Ticket(1), Command::Scan(plan(COLUMNS)), now);
                    }
                    Event::Finished(_, Ok(Answer::Scan(info))) => begun = Some(info),
                    other => panic!("{other:?}"),
                }
            }
        }
        let (identity, info) = (identity.unwrap(), begun.unwrap());
        let kept = InterruptedScan::new(ColumnSource::of(&identity), plan(COLUMNS), info);
        let scan = Recovery::begun(settings().resume, identity, plan(COLUMNS), info, now);
        Self {
            now,
            device,
            session: Some(session),
            plugged: true,
            scan,
            columns: 0,
            resumed: 0,
            told: Vec::new(),
            over: None,
            mishap: Mishap::None,
            kept,
            laser_seen: false,
        }
    }

    /// In the midst of a scan.
    pub(super) fn new() -> Self {
        let mut rig = Self::before_any_column();
        rig.run_until("columns", |rig| rig.columns > 30);
        rig
    }

    fn expected(&self, index: u32) -> RawColumn {
        let whole = expected(index);
        if self.device.gap.contains(&index) {
            RawColumn {
                index,
                table_counts: whole.table_counts,
                ..RawColumn::default()
            }
        } else {
            whole
        }
    }

    pub(super) fn step(&mut self) {
        self.now += STEP;
        self.host();
        self.device_alone();
    }

    /// What the service's thread does in a turn.
    fn host(&mut self) {
        let now = self.now;
        if self.session.is_none() && self.plugged {
            self.session = Some(Session::new("bench", settings(), 0, now));
        }
        if let Some(session) = &mut self.session {
            if !self.plugged {
                session.lose(ScannerError::LostConnection {
                    port: "bench".into(),
                    why: "unplugged".into(),
                });
            }
            session.poll(now);
            let out = session.take_output();
            if self.mishap == Mishap::DoorBeforeContinue && has_continue(&out) {
                self.mishap = Mishap::None;
                self.device.strike(Faults::INTERLOCK, now);
            }
            if self.plugged {
                self.device.receive(&out, now);
                for frame in self.device.poll(now) {
                    session.receive(frame.as_bytes(), now);
                }
            }
            while let Some(event) = session.next_event() {
                if matches!(self.scan.event(event, now), Some(Event::Lost(_))) {
                    self.session = None;
                    break;
                }
            }
        }
        self.scan.poll(self.session.as_mut(), now);
        while let Some(progress) = self.scan.next_progress() {
            match progress {
                Progress::Column(column) => {
                    assert_eq!(column, self.expected(self.columns));
                    self.columns += 1;
                    self.kept.add(column.clone()).unwrap();
                    self.scan.acknowledge(column.index);
                    if let Some(session) = &mut self.session {
                        session.acknowledge(column.index, now);
                    }
                }
                Progress::Paused(pause) => self.told.push(pause),
                Progress::Resumed => self.resumed += 1,
                Progress::Over(result) => self.over = Some(result),
            }
        }
    }

    /// Time passes at the device, whatever the host does.
    fn device_alone(&mut self) {
        if !self.plugged {
            self.device.poll(self.now);
        }
        if self.mishap == Mishap::StallsAlways && self.device.is_measuring() {
            self.device.strike(Faults::TABLE_STALL, self.now);
        }
        self.laser_seen |= self.device.laser_on;
    }

    pub(super) fn run_for(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.step();
        }
    }

    pub(super) fn run_until(&mut self, awaited: &str, done: impl Fn(&Self) -> bool) {
        let until = self.now + 5 * MINUTE;
        while !done(self) {
            assert!(self.now < until, "no {awaited}; told: {:?}", self.told);
            self.step();
        }
    }

    /// The program ends without a word, and another takes up the scan after this time, of which
    /// it knows.
    pub(super) fn program_ends(&mut self, time: Duration, waits_for: Option<&str>) {
        self.session = None;
        self.sleep(time);
        self.told.clear();
        let mut kept = self.kept.clone();
        kept.silent = time;
        kept.waits_for = waits_for.map(str::to_owned);
        self.scan = Recovery::taken_up(settings().resume.unwrap(), kept, self.now);
    }

    /// Nothing of the host's runs, as in a computer that is suspended.
    pub(super) fn sleep(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.now += STEP;
            self.device.poll(self.now);
        }
    }

    /// The same, but what the device says is kept on the line until the computer wakes.
    pub(super) fn sleep_while_the_line_keeps(&mut self, time: Duration) {
        let until = self.now + time;
        let mut kept = Vec::new();
        while self.now < until {
            self.now += STEP;
            for frame in self.device.poll(self.now) {
                kept.extend_from_slice(frame.as_bytes());
            }
        }
        if let Some(session) = &mut self.session {
            session.receive(&kept, self.now);
        }
    }

    pub(super) fn until_a_person_is_asked(&mut self) -> ScannerError {
        self.run_until("question", Self::asks);
        self.last_told().cause.clone()
    }

    pub(super) fn until_asked_about(&mut self, faults: Faults) {
        match self.until_a_person_is_asked() {
            ScannerError::Fault(told) => assert!(told.contains(faults), "{told:?}"),
            other => panic!("{other:?}"),
        }
    }

    pub(super) fn asks(&self) -> bool {
        self.told.last().is_some_and(|pause| pause.needs_person)
    }

    pub(super) fn last_told(&self) -> &Pause {
        self.told.last().unwrap()
    }

    pub(super) fn resume(&mut self) {
        self.told.clear();
        self.scan.resume(self.now).unwrap();
    }

    pub(super) fn pause(&mut self) {
        self.scan.pause().unwrap();
    }

    /// The laser stays off for a good while, and a person is still asked.
    pub(super) fn stays_dark(&mut self) {
        self.laser_seen = self.device.laser_on;
        self.run_for(MINUTE);
        assert!(!self.laser_seen);
        assert!(self.asks(), "{:?}", self.told);
    }

    pub(super) fn run_to_its_end(&mut self) {
        self.run_until("end", |rig| rig.over.is_some());
        assert_eq!(self.over, Some(Ok(())));
        assert_eq!(self.columns, COLUMNS);
    }
}

fn settings() -> LinkSettings {
    LinkSettings {
        resume: Some(ResumeSettings::default()),
        ..LinkSettings::default()
    }
}

fn exchange(session: &mut Session, device: &mut Device, now: Duration) {
    session.poll(now);
    device.receive(&session.take_output(), now);
    for frame in device.poll(now) {
        session.receive(frame.as_bytes(), now);
    }
}

fn has_continue(mut bytes: &[u8]) -> bool {
    let mut decoder = Decoder::new();
    std::iter::from_fn(|| decoder.next(&mut bytes)).any(|packet| packet.kind == Continue::KIND)
}
