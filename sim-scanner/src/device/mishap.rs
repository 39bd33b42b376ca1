//! What goes wrong in a device and around it, by itself and at given rates.

use core::time::Duration;

use scanner_protocol::{Faults, ResetCause};

use super::Device;
use crate::Vec3;
use crate::fault::Strikes;
use crate::random::{Draws, Purpose};

/// Rates of mishaps, per measured column; 0 for none. See [`crate::fault`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mishaps {
    /// The firmware starts anew.
    pub reset: f64,
    /// The table stops following its motor.
    pub table_stall: f64,
    /// The table runs into a limit switch.
    pub limit_switch: f64,
    /// The head gets too hot.
    pub over_temperature: f64,
    /// The laser does not light.
    pub laser: f64,
    /// The safety interlock opens, and closes again.
    pub interlock: f64,
    /// Somebody bumps into the table: it stalls, and the object stands elsewhere.
    pub move_part: f64,
    /// How far elsewhere, millimetres.
    pub move_mm: f64,
    /// The device's clock jumps, forward or back.
    pub clock_jump: f64,
    /// The cable is pulled, and put back.
    pub unplug: f64,
    /// The same, but another device is plugged in first.
    pub wrong_serial: f64,
    /// Rate of random bytes before the banner, per start of the firmware.
    pub babble: f64,
    /// How long a cause stays, or the cable is out.
    pub hold: Duration,
    /// Seed of the mishaps.
    pub seed: u64,
}

impl Default for Mishaps {
    fn default() -> Self {
        Self {
            reset: 0.0,
            table_stall: 0.0,
            limit_switch: 0.0,
            over_temperature: 0.0,
            laser: 0.0,
            interlock: 0.0,
            move_part: 0.0,
            move_mm: 1.0,
            clock_jump: 0.0,
            unplug: 0.0,
            wrong_serial: 0.0,
            babble: 0.0,
            hold: Duration::from_secs(2),
            seed: 0,
        }
    }
}

/// Serial number of the device that is plugged in by mistake.
const OTHER_SERIAL: &str = "SIM-OTHER";

/// Most bytes of babble.
const BABBLE_MAX: u64 = 200;

/// A clock jumps by less than this, and to less than that from its end.
const LONGEST_JUMP_MS: u64 = 7_200_000;
const SOON_MS: u32 = 1_000;

/// The mishaps of one device, and what is still to come of them.
#[derive(Debug)]
pub(super) struct Mischief {
    rates: Mishaps,
    draws: Draws,
    later: Vec<(Duration, Later)>,
    /// The plug is out.
    unplugged: bool,
    /// The device on the cable is another one.
    other: bool,
    /// How far the device's clock is ahead; what is behind is ahead by nearly all of its range.
    clock_off_ms: u32,
    strikes: Strikes,
}

/// What happens some time after a mishap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Later {
    Mend(Faults),
    Plug,
    PlugOther,
    Unplug,
}

impl Mischief {
    pub(super) fn new(rates: Mishaps) -> Self {
        Self {
            draws: Draws::keyed(rates.seed, Purpose::Mishap, &[]),
            rates,
            later: Vec::new(),
            unplugged: false,
            other: false,
            clock_off_ms: 0,
            strikes: Strikes::default(),
        }
    }

    /// Random bytes before a banner, or none.
    pub(super) fn babble(&mut self) -> Vec<u8> {
        if self.draws.uniform() >= self.rates.babble {
            return Vec::new();
        }
        self.strikes.note("babble");
        let length = 1 + self.draws.bits() % BABBLE_MAX;
        (0..length).map(|_| self.draws.bits() as u8).collect()
    }

    pub(super) fn due(&self) -> Option<Duration> {
        self.later.iter().map(|(time, _)| *time).min()
    }

    /// How far the device's clock is ahead.
    pub(super) fn clock_off_ms(&self) -> u32 {
        self.clock_off_ms
    }

    fn jump_the_clock(&mut self, uptime_ms: u32) {
        let way = self.draws.bits();
        let by_ms = ((way >> 8) % LONGEST_JUMP_MS) as u32;
        self.clock_off_ms = match way % 3 {
            0 => self.clock_off_ms.wrapping_add(by_ms),
            1 => self.clock_off_ms.wrapping_sub(by_ms),
            // It begins anew soon.
            _ => (u32::MAX - by_ms % SOON_MS).wrapping_sub(uptime_ms),
        };
    }

    fn strikes(&mut self, key: &'static str, rate: f64) -> bool {
        // Drawn at any rate, so that one class added leaves the others where they were.
        let strikes = self.draws.uniform() < rate;
        if strikes {
            self.strikes.note(key);
        }
        strikes
    }
}

impl Device {
    /// Whether the cable is out, by a mishap.
    #[must_use]
    pub fn is_unplugged(&self) -> bool {
        self.mischief.unplugged
    }

    /// How often which mishap has struck so far.
    #[must_use]
    pub fn strikes(&self) -> &Strikes {
        &self.mischief.strikes
    }

    /// Shifts the object on the table, unknown to the device.
    pub fn move_part(&mut self, by_mm: Vec3) {
        let from_mm = self.source.part_offset_mm();
        if let Some(scan) = &mut self.scan {
            scan.note_move(from_mm);
        }
        self.source.set_part_offset_mm(from_mm + by_mm);
    }

    /// The interlock's input: while it is open, the laser is off and the table stands.
    pub fn set_interlock(&mut self, open: bool, now: Duration) {
        if open {
            self.raise_faults(Faults::INTERLOCK, now);
        } else {
            self.mend(Faults::INTERLOCK);
        }
    }

    pub(super) fn serial(&self) -> &str {
        if self.mischief.other {
            OTHER_SERIAL
        } else {
            &self.settings.serial
        }
    }

    /// Lets what is due of earlier mishaps happen.
    pub(super) fn mishaps_go_on(&mut self, now: Duration) {
        while let Some(at) = self
            .mischief
            .later
            .iter()
            .position(|(time, _)| *time <= now)
        {
            let (_, what) = self.mischief.later.remove(at);
            match what {
                Later::Mend(faults) => self.mend(faults),
                Later::Unplug => self.pull(now),
                Later::Plug | Later::PlugOther => {
                    let other = what == Later::PlugOther;
                    self.mischief.unplugged = false;
                    if self.mischief.other != other {
                        self.mischief.other = other;
                        self.boot(ResetCause::PowerOn, now);
                    }
                }
            }
        }
    }

    fn pull(&mut self, now: Duration) {
        self.mischief.unplugged = true;
        self.out.clear();
        // A device on USB notices; one on a serial line has its dead-man time.
        if self.settings.feels_the_plug {
            self.lose_line(now);
            self.out.clear();
        }
    }

    /// What may go wrong once a column has been measured.
    pub(super) fn risk_mishaps(&mut self, now: Duration) {
        let rates = self.mischief.rates;
        let later = now + rates.hold;
        if self.mischief.strikes("clock-jump", rates.clock_jump) {
            let uptime_ms = now.saturating_sub(self.booted).as_millis() as u32;
            self.mischief.jump_the_clock(uptime_ms);
        }
        let lasting = [
            ("laser", rates.laser, Faults::LASER),
            (
                "over-temperature",
                rates.over_temperature,
                Faults::OVER_TEMPERATURE,
            ),
            ("interlock", rates.interlock, Faults::INTERLOCK),
            ("limit-switch", rates.limit_switch, Faults::LIMIT_SWITCH),
        ];
        for (key, rate, faults) in lasting {
            if self.mischief.strikes(key, rate) {
                if faults == Faults::LIMIT_SWITCH {
                    self.lose_place();
                }
                self.raise_faults(faults, now);
                self.mischief.later.push((later, Later::Mend(faults)));
            }
        }
        let moved = self.mischief.strikes("move-part", rates.move_part);
        if moved {
            self.move_part(Vec3::new(0.0, rates.move_mm / 2.0, rates.move_mm));
        }
        if self.mischief.strikes("table-stall", rates.table_stall) || moved {
            self.lose_place();
            self.raise_faults(Faults::TABLE_STALL, now);
            self.mend(Faults::TABLE_STALL);
        }
        if self.mischief.strikes("reset", rates.reset) {
            self.reset(ResetCause::Watchdog, now);
        }
        let swapped = self.mischief.strikes("wrong-serial", rates.wrong_serial);
        if (self.mischief.strikes("unplug", rates.unplug) || swapped) && !self.mischief.unplugged {
            self.pull(now);
            let plan = &mut self.mischief.later;
            if swapped {
                plan.push((later, Later::PlugOther));
                plan.push((later + rates.hold * 3, Later::Unplug));
                plan.push((later + rates.hold * 4, Later::Plug));
            } else {
                plan.push((later, Later::Plug));
            }
        }
    }

    /// The position of the table is not known any more.
    fn lose_place(&mut self) {
        self.homed = false;
    }
}
