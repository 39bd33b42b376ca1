//! The device's side of the protocol: a state machine without I/O and without a clock.
//!
//! [`Device::receive`] takes bytes and the time, [`Device::poll`] gives bytes and the time at
//! which it wants to be polled again. Time is a duration since any fixed moment.
//!
//! The laser is on while columns are being taken, or while the host has it on by hand, and
//! never otherwise: abort, fault, reset and a silent host turn it off and stop the table.

mod bench;
mod events;
mod mishap;
mod requests;
mod scan;
mod settings;
mod table;

use core::time::Duration;

use scanner_protocol::commands::Rejected;
use scanner_protocol::{
    Activity, Decoder, DecoderCounts, Faults, Frame, HostMessage, MIN_VERSION, Message,
    MessageError, OnceOnly, Packet, RejectReason, ResetCause, ScanEndReason, Status,
    events::{Banner, StatusChanged},
};

pub use events::{Event, Snapshot};
pub use mishap::Mishaps;
pub use settings::DeviceSettings;

use crate::random::{Draws, Purpose};
use crate::source::Source;
use bench::Bench;
use events::EventLog;
use mishap::Mischief;
use scan::Scan;
use table::Drive;

/// What [`Device::poll`] gives.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Poll {
    /// Bytes for the host; to be written whole before the next poll.
    pub bytes: Vec<u8>,
    /// When to poll again even if no byte comes in; `None` for never.
    pub wake: Option<Duration>,
}

/// Kinds of messages from here on are the device's own.
const DEVICE_KINDS: u8 = 0x80;

/// Bytes after which a poll stops measuring: enough to keep a line busy, few enough that an
/// abort is heard soon.
const POLL_BYTES: usize = 4096;

/// Temperature of the head at work, and when it is too hot, hundredths of a degree Celsius.
const WARM_CDEGC: i16 = 3_150;
const TOO_HOT_CDEGC: i16 = 7_200;

/// What the table is at, scans aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Task {
    None,
    Homing,
    Moving,
}

/// A simulated device.
#[derive(Debug)]
pub struct Device {
    source: Source,
    settings: DeviceSettings,
    seed: u64,
    decoder: Decoder,
    once: OnceOnly,
    /// The dead-man time of the open session.
    session: Option<Duration>,
    /// Its version of the protocol.
    version: u8,
    heard: Duration,
    booted: Duration,
    boots: u64,
    running_tag: u16,
    frames_resent: u64,
    drive: Drive,
    homed: bool,
    task: Task,
    laser_on: bool,
    laser_by_hand: bool,
    faults: Faults,
    /// Faults whose cause is there still.
    causes: Faults,
    scan: Option<Scan>,
    scans: u64,
    told: Activity,
    out: Vec<u8>,
    log: EventLog,
    bench: Bench,
    mischief: Mischief,
}

impl Device {
    /// A device that has just been switched on; `seed` makes its boot ids.
    #[must_use]
    pub fn new(source: Source, settings: DeviceSettings, seed: u64, now: Duration) -> Self {
        let parked = source
            .limits()
            .table_min_counts
            .saturating_add(settings.parked_counts);
        let mut device = Self {
            mischief: Mischief::new(settings.mishaps),
            source,
            settings,
            seed,
            decoder: Decoder::new(),
            once: OnceOnly::default(),
            session: None,
            version: MIN_VERSION,
            heard: now,
            booted: now,
            boots: 0,
            running_tag: 0,
            frames_resent: 0,
            drive: Drive::standing(parked),
            homed: false,
            task: Task::None,
            laser_on: false,
            laser_by_hand: false,
            faults: Faults::NONE,
            causes: Faults::NONE,
            scan: None,
            scans: 0,
            told: Activity::Idle,
            out: Vec::new(),
            log: EventLog::default(),
            bench: Bench::default(),
        };
        device.boot(ResetCause::PowerOn, now);
        device
    }

    /// What the device measures with.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// What the decoder has seen of the host's bytes.
    #[must_use]
    pub fn received(&self) -> DecoderCounts {
        self.decoder.counts()
    }

    /// Takes bytes from the host.
    pub fn receive(&mut self, mut bytes: &[u8], now: Duration) {
        self.advance(now);
        while let Some(packet) = self.decoder.next(&mut bytes) {
            // Its own words, sent back by a line with an echo, are no sign of a host.
            if packet.kind < DEVICE_KINDS {
                self.heard = now;
            }
            self.handle(packet, now);
        }
    }

    /// Does what is due, and gives what is to be sent.
    pub fn poll(&mut self, now: Duration) -> Poll {
        self.advance(now);
        self.scan_work(now);
        let activity = self.activity(now);
        if activity != self.told {
            self.told = activity;
            self.tell_status(now);
        }
        let wake = self.next_wake(now);
        Poll {
            bytes: core::mem::take(&mut self.out),
            wake,
        }
    }

    /// Does only what safety needs, while the line takes no bytes: a silent host is noticed.
    pub fn guard(&mut self, now: Duration) {
        self.advance(now);
    }

    /// The line to the host is gone, and the device can tell: there is no need to wait for the
    /// dead-man time.
    pub fn lose_line(&mut self, now: Duration) {
        self.advance(now);
        if self.session.is_some() && self.at_work(now) {
            self.stop_by_itself(now);
        }
    }

    /// When [`Device::guard`] has something to do.
    #[must_use]
    pub fn safety_wake(&self, now: Duration) -> Option<Duration> {
        self.session
            .filter(|_| self.at_work(now))
            .map(|dead_man| self.heard + dead_man)
    }

    /// How the device is.
    #[must_use]
    pub fn snapshot(&self, now: Duration) -> Snapshot {
        Snapshot {
            activity: self.activity(now),
            laser_on: self.laser_on,
            homed: self.homed,
            table_counts: self.table_counts(now),
            faults: self.faults,
            columns_sent: self.scan.as_ref().map_or(0, Scan::sent),
            acknowledged_below: self.scan.as_ref().map_or(0, Scan::acknowledged),
            frames_resent: self.frames_resent,
            frames_received: self.decoder.counts().frames,
        }
    }

    fn boot(&mut self, cause: ResetCause, now: Duration) {
        self.boots += 1;
        self.booted = now;
        self.session = None;
        self.once.forget();
        self.scan = None;
        self.homed = false;
        self.task = Task::None;
        self.drive.stop(now);
        self.laser_by_hand = false;
        self.set_laser(false);
        self.faults = self.causes;
        self.told = self.activity(now);
        self.log.push(Event::Booted);
        let babble = self.mischief.babble();
        self.out.extend(babble);
        let banner = Banner {
            min_version: MIN_VERSION,
            max_version: self.settings.max_version,
            boot_id: self.boot_id(),
            cause,
        };
        self.tell(&banner);
    }

    fn boot_id(&self) -> u32 {
        Draws::keyed(self.seed, Purpose::Line, &[self.boots]).bits() as u32
    }

    /// Lets time pass: arrivals, and a host that has been silent too long.
    fn advance(&mut self, now: Duration) {
        self.mishaps_go_on(now);
        if let Some(dead_man) = self.session
            && self.at_work(now)
            && now.saturating_sub(self.heard) >= dead_man
        {
            self.stop_by_itself(now);
        }
        if self.task != Task::None && !self.drive.moves(now) {
            if self.task == Task::Homing {
                self.homed = true;
                self.log.push(Event::Homed);
            }
            self.task = Task::None;
            self.log.push(Event::Table { moving: false });
        }
    }

    /// What a silent host leads to.
    fn stop_by_itself(&mut self, now: Duration) {
        self.log.push(Event::DeadMan);
        self.faults = self.faults.union(Faults::DEAD_MAN);
        self.log.push(Event::Faults(self.faults));
        self.halt(ScanEndReason::DeadMan, now);
        self.tell_status(now);
    }

    /// Whether something moves or shines that a silent host must not leave behind.
    fn at_work(&self, now: Duration) -> bool {
        self.laser_on || self.drive.moves(now) || self.scan.as_ref().is_some_and(Scan::is_running)
    }

    /// Laser off, table stopped; a running scan ends for this reason.
    fn halt(&mut self, reason: ScanEndReason, now: Duration) {
        self.laser_by_hand = false;
        self.set_laser(false);
        self.stop_table(now);
        self.end_scan(reason, now);
    }

    fn stop_table(&mut self, now: Duration) {
        if self.drive.moves(now) {
            self.log.push(Event::Table { moving: false });
        }
        self.drive.stop(now);
        self.task = Task::None;
    }

    fn start_table(&mut self, to_counts: i32, now: Duration) {
        let count_mm = f64::from(self.source.calibration().table_count_pm) / 1e9;
        let counts_per_s = self.settings.table_speed_mm_s / count_mm;
        self.drive.go(to_counts, counts_per_s, now);
        self.log.push(Event::Table { moving: true });
    }

    fn set_laser(&mut self, on: bool) {
        if on != self.laser_on {
            self.laser_on = on;
            self.log.push(Event::Laser(on));
        }
    }

    fn activity(&self, now: Duration) -> Activity {
        if let Some(activity) = self
            .scan
            .as_ref()
            .and_then(|scan| scan.activity(self.stepped()))
        {
            return activity;
        }
        match self.task {
            Task::Homing if self.drive.moves(now) => Activity::Homing,
            Task::Moving if self.drive.moves(now) => Activity::Moving,
            _ if !self.blocking_faults().is_empty() => Activity::Faulted,
            _ => Activity::Idle,
        }
    }

    fn blocking_faults(&self) -> Faults {
        self.faults.without(Faults::REPORTED_ONLY)
    }

    fn table_counts(&self, now: Duration) -> i32 {
        if self.homed { self.drive.at(now) } else { 0 }
    }

    fn status(&self, now: Duration) -> Status {
        Status {
            boot_id: self.boot_id(),
            // The counter of a device, which begins anew after 49 days.
            uptime_ms: (now.saturating_sub(self.booted).as_millis() as u32)
                .wrapping_add(self.mischief.clock_off_ms()),
            activity: self.activity(now),
            homed: self.homed,
            laser_on: self.laser_on,
            faults: self.faults,
            table_counts: self.table_counts(now),
            temperature_cdegc: if self.faults.contains(Faults::OVER_TEMPERATURE) {
                TOO_HOT_CDEGC
            } else {
                WARM_CDEGC
            },
            scan_id: self.scan.as_ref().map_or(0, Scan::id),
            columns: self.scan.as_ref().map_or(0, Scan::sent),
        }
    }

    fn next_wake(&self, now: Duration) -> Option<Duration> {
        let dead_man = self.safety_wake(now);
        let arrival = self.drive.moves(now).then(|| self.drive.arrival());
        let scan = self.scan.as_ref().and_then(|s| s.due(self.stepped(), now));
        let mishap = self.mischief.due();
        [dead_man, arrival, scan, mishap]
            .into_iter()
            .flatten()
            .min()
    }

    /// Queues a message that answers no request.
    fn tell<M: Message>(&mut self, message: &M) {
        let tag = self.running_tag;
        self.running_tag = tag.wrapping_add(1);
        self.send(&Frame::new(tag, message));
    }

    fn tell_status(&mut self, now: Duration) {
        let status = self.status(now);
        self.told = status.activity;
        self.tell(&StatusChanged(status));
    }

    fn send(&mut self, frame: &Frame) {
        self.bench.pass(frame, &mut self.out);
    }

    fn handle(&mut self, packet: Packet, now: Duration) {
        match HostMessage::decode(&packet) {
            Ok(message) => self.carry_out(packet, message, now),
            Err(MessageError::UnknownKind(kind)) if kind >= DEVICE_KINDS => {}
            Err(MessageError::UnknownKind(_)) => {
                self.reject(&packet, RejectReason::UnknownCommand, 0);
            }
            Err(_) => self.reject(&packet, RejectReason::Malformed, 0),
        }
    }

    fn reject(&mut self, packet: &Packet, reason: RejectReason, detail: u32) {
        let rejection = self.rejection(packet, reason, detail);
        self.send(&rejection);
    }

    /// The reply to a request that is refused.
    fn rejection(&mut self, packet: &Packet, reason: RejectReason, detail: u32) -> Frame {
        self.log.push(Event::Rejected);
        let rejected = Rejected {
            request: packet.kind,
            reason,
            detail,
        };
        Frame::new(packet.tag, &rejected)
    }
}

#[cfg(test)]
mod tests;
