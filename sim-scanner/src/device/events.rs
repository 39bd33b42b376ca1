//! What happened inside a device, for those who test against it.

use std::collections::VecDeque;

use scanner_protocol::{Activity, Faults, ScanEndReason};

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The firmware started.
    Booted,
    /// The host opened a session.
    SessionOpened,
    /// The table's position is known.
    Homed,
    /// The laser went on or off.
    Laser(bool),
    /// The table started or stopped moving.
    Table {
        /// Whether it moves now.
        moving: bool,
    },
    /// A scan was accepted.
    ScanStarted {
        /// The host's number for it.
        scan_id: u16,
        /// Columns that will come.
        columns: u32,
    },
    /// A column was measured and sent.
    ColumnSent(u32),
    /// The device waits for credit, with this many columns sent.
    OutOfCredit(u32),
    /// A column, or some fragments of it, were sent again.
    Resent(u32),
    /// The host has every column below this index.
    Acknowledged(u32),
    /// No column will be measured any more.
    ScanEnded(ScanEndReason),
    /// The host closed the scan.
    ScanClosed,
    /// The host aborted everything.
    Aborted,
    /// The host was silent too long while laser or table were at work.
    DeadMan,
    /// The faults changed.
    Faults(Faults),
    /// A request was refused.
    Rejected,
}

/// How the device is at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Snapshot {
    /// What it is at.
    pub activity: Activity,
    /// Whether the laser is on.
    pub laser_on: bool,
    /// Whether the table's position is known.
    pub homed: bool,
    /// Where the table is, counts.
    pub table_counts: i32,
    /// The faults.
    pub faults: Faults,
    /// Columns of the scan sent so far.
    pub columns_sent: u32,
    /// Columns of the scan that the host has.
    pub acknowledged_below: u32,
    /// Frames sent because the host asked for them again, since the start of the simulator.
    pub frames_resent: u64,
    /// Good frames received since the start of the simulator.
    pub frames_received: u64,
}

/// The latest events, numbered from the start of the simulator.
#[derive(Debug, Clone, Default)]
pub(crate) struct EventLog {
    kept: VecDeque<Event>,
    dropped: u64,
}

/// Events kept for those who look late.
const KEPT_MAX: usize = 65_536;

impl EventLog {
    pub(crate) fn push(&mut self, event: Event) {
        if self.kept.len() == KEPT_MAX {
            self.kept.pop_front();
            self.dropped += 1;
        }
        self.kept.push_back(event);
    }

    /// The number that the next event will have.
    pub(crate) fn end(&self) -> u64 {
        self.dropped + self.kept.len() as u64
    }

    /// The events from a number on, each with its own number.
    pub(crate) fn since(&self, number: u64) -> impl Iterator<Item = (u64, Event)> + '_ {
        let skip = number.saturating_sub(self.dropped) as usize;
        (self.dropped..).zip(self.kept.iter().copied()).skip(skip)
    }
}
