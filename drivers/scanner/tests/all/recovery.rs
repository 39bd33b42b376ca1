//! A scan across interruptions under simulated time: who lets it go on, and when the laser may
//! be on again.

use std::time::Duration;

use scanner_driver::protocol::commands::Continue;
use scanner_driver::protocol::{Activity, Decoder, Faults, Message};
use scanner_driver::recovery::{Progress, Recovery};
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_driver::{LinkSettings, Pause, RawColumn, ResumeSettings, ScannerError};

use crate::bench::{STEP, expected, plan};
use crate::device::Device;

const COLUMNS: u32 = 400;
const MINUTE: Duration = Duration::from_secs(60);

/// What happens to the device at an opportune moment.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mishap {
    None,
    /// The table stalls whenever a scan has begun.
    StallsAlways,
    /// The door is opened and closed just before the scan is taken up.
    DoorBeforeContinue,
}

struct Rig {
    now: Duration,
    device: Device,
    session: Option<Session>,
    plugged: bool,
    scan: Recovery,
    columns: u32,
    told: Vec<Pause>,
    over: Option<Result<(), ScannerError>>,
    mishap: Mishap,
    /// The laser has been on since this was last set to `false`.
    laser_seen: bool,
}

impl Rig {
    /// In the midst of a scan.
    fn new() -> Self {
        let mut device = Device::homed();
        let mut now = Duration::ZERO;
        let mut session = Session::new("bench", settings(), now);
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
        let scan = Recovery::begun(
            settings().resume,
            identity.unwrap(),
            plan(COLUMNS),
            begun.unwrap(),
            now,
        );
        let mut rig = Self {
            now,
            device,
            session: Some(session),
            plugged: true,
            scan,
            columns: 0,
            told: Vec::new(),
            over: None,
            mishap: Mishap::None,
            laser_seen: false,
        };
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

    fn step(&mut self) {
        self.now += STEP;
        self.host();
        self.device_alone();
    }

    /// What the service's thread does in a turn.
    fn host(&mut self) {
        let now = self.now;
        if self.session.is_none() && self.plugged {
            self.session = Some(Session::new("bench", settings(), now));
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
                    self.scan.acknowledge(column.index);
                    if let Some(session) = &mut self.session {
                        session.acknowledge(column.index, now);
                    }
                }
                Progress::Paused(pause) => self.told.push(pause),
                Progress::Resumed => {}
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

    fn run_for(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.step();
        }
    }

    fn run_until(&mut self, awaited: &str, done: impl Fn(&Self) -> bool) {
        let until = self.now + 5 * MINUTE;
        while !done(self) {
            assert!(self.now < until, "no {awaited}; told: {:?}", self.told);
            self.step();
        }
    }

    /// Nothing of the host's runs, as in a computer that is suspended.
    fn sleep(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.now += STEP;
            self.device.poll(self.now);
        }
    }

    /// The same, but what the device says is kept on the line until the computer wakes.
    fn sleep_while_the_line_keeps(&mut self, time: Duration) {
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

    fn until_a_person_is_asked(&mut self) -> ScannerError {
        self.run_until("question", Self::asks);
        self.last_told().cause.clone()
    }

    fn until_asked_about(&mut self, faults: Faults) {
        match self.until_a_person_is_asked() {
            ScannerError::Fault(told) => assert!(told.contains(faults), "{told:?}"),
            other => panic!("{other:?}"),
        }
    }

    fn asks(&self) -> bool {
        self.told.last().is_some_and(|pause| pause.needs_person)
    }

    fn last_told(&self) -> &Pause {
        self.told.last().unwrap()
    }

    fn resume(&mut self) {
        self.told.clear();
        self.scan.resume(self.now).unwrap();
    }

    /// The laser stays off for a good while, and a person is still asked.
    fn stays_dark(&mut self) {
        self.laser_seen = self.device.laser_on;
        self.run_for(MINUTE);
        assert!(!self.laser_seen);
        assert!(self.asks(), "{:?}", self.told);
    }

    fn run_to_its_end(&mut self) {
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

#[test]
fn a_short_pause_ends_by_itself_and_a_long_one_waits_for_a_person() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(14 * MINUTE);
    assert!(!rig.last_told().needs_person);
    rig.plugged = true;
    rig.run_until("columns", |rig| rig.columns > 80);
    rig.plugged = false;
    rig.run_for(14 * MINUTE);
    assert!(!rig.last_told().needs_person);
    rig.run_for(MINUTE);
    assert!(rig.last_told().needs_person);
    rig.plugged = true;
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_computer_that_was_suspended_for_long_asks_a_person_first() {
    let mut rig = Rig::new();
    rig.sleep(60 * MINUTE);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
    // Nor may the time pass while the table is homed.
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(15 * MINUTE - Duration::from_millis(500));
    rig.plugged = true;
    rig.run_until("homing", |rig| rig.device.homings == 1);
    rig.stays_dark();
}

#[test]
fn columns_that_a_sleeping_computer_finds_in_its_buffers_are_no_news() {
    let mut rig = Rig::new();
    rig.run_until("columns", |rig| rig.columns > 20);
    let before = rig.columns;
    rig.sleep_while_the_line_keeps(60 * MINUTE);
    rig.step();
    assert!(rig.columns > before, "the line kept none");
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn after_ten_attempts_a_person_is_asked() {
    let mut rig = Rig::new();
    rig.mishap = Mishap::StallsAlways;
    let scans = rig.device.scans;
    let cause = rig.until_a_person_is_asked();
    assert_eq!(cause, ScannerError::Fault(Faults::TABLE_STALL));
    assert_eq!(rig.device.scans, scans + 10);
    rig.mishap = Mishap::None;
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_scanner_calibrated_anew_is_waited_for_and_not_used() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.device.count_pm += 1;
    rig.laser_seen = false;
    rig.run_for(MINUTE);
    assert!(!rig.laser_seen);
    let told = rig.last_told();
    assert_eq!(
        (told.needs_person, &told.cause),
        (false, &ScannerError::OtherCalibration)
    );
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.count_pm -= 1;
    rig.plugged = true;
    rig.run_to_its_end();
}

#[test]
fn a_word_said_before_the_door_was_opened_does_not_count() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(MINUTE);
    // This pause would have ended by itself.
    rig.resume();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_word_about_another_fault_does_not_count() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::LIMIT_SWITCH, now);
    rig.until_a_person_is_asked();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.resume();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.plugged = true;
    let both = Faults::LIMIT_SWITCH | Faults::INTERLOCK;
    rig.until_asked_about(both);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_word_is_used_up_by_the_homing_that_follows_it() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_asked_about(Faults::INTERLOCK);
    rig.resume();
    rig.run_until("homing", |rig| rig.device.activity == Activity::Homing);
    // The door is opened once more, and closed, while the cable is out.
    rig.plugged = false;
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_door_opened_between_homing_and_going_on_asks_a_person() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_a_person_is_asked();
    rig.mishap = Mishap::DoorBeforeContinue;
    rig.resume();
    rig.run_until("door", |rig| rig.mishap == Mishap::None);
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn another_scanner_does_not_end_the_wait_for_a_person() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_a_person_is_asked();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.serial = "0002";
    rig.plugged = true;
    rig.run_until("other scanner", |rig| {
        matches!(rig.last_told().cause, ScannerError::OtherScanner { .. })
    });
    rig.stays_dark();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.serial = "0001";
    rig.plugged = true;
    rig.stays_dark();
    // What was told first has been seen as well.
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn an_object_moved_while_nothing_was_in_view_is_noticed() {
    let mut rig = Rig::new();
    rig.device.gap = 100..300;
    rig.run_until("gap", |rig| rig.columns > 250);
    rig.plugged = false;
    // Half a millimetre.
    rig.device.moved_counts = 50_000;
    rig.run_for(MINUTE);
    rig.plugged = true;
    let cause = rig.until_a_person_is_asked();
    assert!(matches!(cause, ScannerError::Moved { .. }), "{cause:?}");
    assert!(rig.columns < 300);
    rig.run_until("laser off", |rig| !rig.device.laser_on);
    rig.stays_dark();
    rig.device.moved_counts = 0;
    rig.resume();
    rig.run_to_its_end();
}
