//! What is around driver and device: the disk, a person, and a computer that sleeps.

use std::time::Duration;

use scanner_driver::session::{Command, Ticket};
use sim_scanner::Vec3;
use sim_scanner::source::Source;

use super::Simulation;
use crate::conditions::{CLOCK_JUMP, HOST_SLEEP, LONG_SLEEP, PAUSE};

/// How long a person takes to look.
const PERSON: Duration = Duration::from_secs(30);

/// So often a person lets a scan go on without a new column coming of it.
const PATIENCE: u32 = 20;

/// How long a column takes to the disk, mostly.
const DISK: Duration = Duration::from_millis(4);

/// Share of columns on which the disk is slow, and how long it takes for these at most.
const SLOW_DISK: f64 = 0.1;
const SLOWEST_DISK: Duration = Duration::from_secs(2);

/// The longest of the short sleeps, seconds.
const SLEEP_S: f64 = 20.0;

/// The shortest and the longest of the long ones: a person must have looked after a quarter
/// of an hour.
const LONG_SLEEP_S: (f64, f64) = (16.0 * 60.0, 3600.0);

/// The least and the most by which a clock leaps: two of them are below that quarter of an hour.
const LEAP_S: (f64, f64) = (1.0, 400.0);

/// A pause comes so long after a column, seconds, at most.
pub(super) const PAUSE_SOON_S: f64 = 0.5;

/// The share of words after which somebody pauses the scan once more, and so long after them,
/// seconds, at most: while the table is homed, or when the scan is just about to go on.
const PAUSED_AGAIN: f64 = 0.5;
const PAUSED_AGAIN_S: f64 = 4.0;

impl Simulation {
    /// Columns reach the disk, and are acknowledged.
    pub(super) fn reach_the_disk(&mut self) {
        let now = self.now;
        let shown = self.clock.shows(now);
        let (done, rest) = self.disk.iter().partition(|(time, _)| *time <= now);
        self.disk = rest;
        let done: Vec<(Duration, u32)> = done;
        for (_, column) in done {
            if let Some(scan) = &mut self.scan {
                scan.acknowledge(column);
            }
            if let Some(session) = &mut self.session {
                session.acknowledge(column, shown);
            }
        }
    }

    /// A column is on its way to the disk, behind those before it.
    pub(super) fn hand_to_the_disk(&mut self, column: u32) {
        let slow = self.disk_dice.uniform() < SLOW_DISK;
        let share = self.disk_dice.uniform();
        let takes = if slow {
            SLOWEST_DISK.mul_f64(share)
        } else {
            DISK
        };
        let safe = self.now + takes;
        let before = self.disk.iter().map(|(time, _)| *time).max();
        self.disk
            .push((before.map_or(safe, |b| b.max(safe)), column));
    }

    /// A person has been asked for, and comes after a while.
    pub(super) fn call_the_person(&mut self) {
        self.person_at = Some(self.now + PERSON);
    }

    /// The person comes, looks, puts right what is wrong, and lets the scan go on.
    pub(super) fn look_after_it(&mut self) {
        if self.person_at.is_none_or(|at| self.now < at) {
            return;
        }
        self.person_at = None;
        self.visits += 1;
        if self.visits > PATIENCE {
            return self.give_up();
        }
        if !std::mem::take(&mut self.conditions.careless) {
            let back = self.stands_mm - self.part_offset_mm();
            self.device.move_part(back);
        }
        if let Some(scan) = &mut self.scan {
            // It may have gone on by itself meanwhile.
            let _ = scan.resume(self.clock.shows(self.now));
        }
        self.guard.word_given(self.now);
        if self.conditions.pause > 0.0 {
            self.risk_a_pause(PAUSED_AGAIN, PAUSED_AGAIN_S);
        }
    }

    /// Somebody may want the scan to stand still, within this time.
    pub(super) fn risk_a_pause(&mut self, rate: f64, within_s: f64) {
        // Nothing is drawn for what cannot happen.
        if rate > 0.0 && self.pause_at.is_none() && self.pause_dice.uniform() < rate {
            let soon_s = within_s * self.pause_dice.uniform();
            self.pause_at = Some(self.now + Duration::from_secs_f64(soon_s));
        }
    }

    /// Somebody pauses the scan, whatever it is at.
    pub(super) fn pause_on_request(&mut self) {
        if self.pause_at.is_none_or(|at| self.now < at) {
            return;
        }
        self.pause_at = None;
        // It may be over meanwhile.
        if let Some(scan) = &mut self.scan
            && scan.pause().is_ok()
        {
            self.strikes.note(PAUSE);
        }
    }

    /// Nothing has come of all the visits.
    fn give_up(&mut self) {
        if let Some(session) = &mut self.session {
            self.tickets += 1;
            let shown = self.clock.shows(self.now);
            session.command(Ticket(self.tickets), Command::Abort, shown);
        }
        if let Some(scan) = &mut self.scan {
            scan.abort();
        }
    }

    /// What may befall the host once it has a column.
    pub(super) fn risk_the_host(&mut self) {
        let rates = self.conditions.host;
        if self.dice.uniform() < rates.sleep {
            self.strikes.note(HOST_SLEEP);
            let time = Duration::from_secs_f64(SLEEP_S * self.dice.uniform());
            self.sleep(time);
        }
        // Nothing is drawn for what cannot happen: earlier seeds go on as they did.
        if rates.long_sleep > 0.0 && self.dice.uniform() < rates.long_sleep {
            self.strikes.note(LONG_SLEEP);
            let (least, most) = LONG_SLEEP_S;
            let time = least + (most - least) * self.dice.uniform();
            self.sleep(Duration::from_secs_f64(time));
        }
        if rates.clock_jump > 0.0 && self.dice.uniform() < rates.clock_jump {
            self.strikes.note(CLOCK_JUMP);
            let (least, most) = LEAP_S;
            let leap_s = least * (most / least).powf(self.dice.uniform());
            let leap = Duration::from_secs_f64(leap_s);
            if self.dice.uniform() < 0.5 {
                self.clock.leap(leap);
            } else {
                self.leap += leap;
            }
        }
    }

    fn sleep(&mut self, time: Duration) {
        self.asleep_until = self.asleep_until.max(self.now + time);
        self.guard.fell_asleep(self.now);
    }

    pub(super) fn part_offset_mm(&self) -> Vec3 {
        match self.device.source() {
            Source::Simulated { scanner, .. } => scanner.part_offset_mm,
            Source::Replay(_) => Vec3::default(),
        }
    }
}
