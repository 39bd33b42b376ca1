//! How the device does.

use crate::faults::Faults;
use crate::message::Message;
use crate::wire::{MessageError, Reader, Writer, codes, message};

message! {
    /// How the device does; the reply to a heartbeat.
    Status = 0x85 {
        /// The number of this start of the device: another one means it was reset.
        boot_id: u32,
        /// Milliseconds since the start, wrapping.
        uptime_ms: u32,
        /// What it is at.
        activity: Activity,
        /// Whether the table's position is known.
        homed: bool,
        /// Whether the laser is on.
        laser_on: bool,
        /// The faults.
        faults: Faults,
        /// Where the table is, counts; 0 until homed.
        table_counts: i32,
        /// Temperature of the head, hundredths of a degree Celsius; -32768 if not measured.
        temperature_cdegc: i16,
        /// The scan that runs, or that ran last and is not closed.
        scan_id: u16,
        /// Columns of it sent so far: how many column ends have left at least once.
        columns: u32,
    }
}

codes! {
    /// What a device is at.
    Activity {
        /// Nothing.
        Idle = 0 => "idle",
        /// Driving to the reference mark.
        Homing = 1 => "homing",
        /// Driving to a position.
        Moving = 2 => "moving",
        /// Measuring columns.
        Scanning = 3 => "scanning",
        /// In a scan, with the table standing, until credit comes.
        Waiting = 4 => "waiting for credit",
        /// Stopped by a fault.
        Faulted = 5 => "stopped by a fault",
    }
}

/// A [`Status`] told without being asked, when a fault came or went or the activity
/// changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusChanged(pub Status);

impl Message for StatusChanged {
    const KIND: u8 = 0xc1;
    const NAME: &'static str = "StatusChanged";

    fn encode(&self, out: &mut Writer) {
        self.0.encode(out);
    }

    fn decode(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        Status::decode(input).map(Self)
    }
}
