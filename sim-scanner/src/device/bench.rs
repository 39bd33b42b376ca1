//! The test bench around a device: what a tester can do to it that a host cannot.

use core::time::Duration;

use scanner_protocol::{Faults, Frame, ResetCause, ScanEndReason};

use super::Device;
use super::events::{Event, EventLog};

/// Switches on the bench.
#[derive(Debug, Default)]
pub(super) struct Bench {
    /// Columns that may still be measured; `None` for as many as come.
    steps: Option<u32>,
    drop_frames: u32,
    corrupt_frames: u32,
}

impl Bench {
    /// Puts a frame on the line, unless it is to be lost or spoilt.
    pub(super) fn pass(&mut self, frame: &Frame, out: &mut Vec<u8>) {
        if self.drop_frames > 0 {
            self.drop_frames -= 1;
            return;
        }
        let start = out.len();
        out.extend_from_slice(frame.as_bytes());
        if self.corrupt_frames > 0 {
            self.corrupt_frames -= 1;
            // Any bit of the body spoils the checksum; the delimiters stay.
            let middle = start + frame.as_bytes().len() / 2;
            if let Some(byte) = out.get_mut(middle) {
                *byte ^= if *byte == 0x10 { 0x20 } else { 0x10 };
            }
        }
    }

    pub(super) fn column_measured(&mut self) {
        if let Some(steps) = &mut self.steps {
            *steps = steps.saturating_sub(1);
        }
    }
}

impl Device {
    /// Whether the tester holds the columns back.
    pub(super) fn stepped(&self) -> bool {
        self.bench.steps == Some(0)
    }

    /// Measures only as many further columns, as if the table had to be pushed by hand;
    /// `None` ends that.
    pub fn step_columns(&mut self, columns: Option<u32>) {
        self.bench.steps = columns;
    }

    /// Loses the next frames that the device sends.
    pub fn drop_frames(&mut self, frames: u32) {
        self.bench.drop_frames = frames;
    }

    /// Spoils a bit in each of the next frames that the device sends.
    pub fn corrupt_frames(&mut self, frames: u32) {
        self.bench.corrupt_frames = frames;
    }

    /// Puts bytes on the line that are no frame.
    pub fn send_garbage(&mut self, bytes: &[u8]) {
        self.out.extend_from_slice(bytes);
    }

    /// Makes faults come true: the laser goes off, the table stops, a scan ends.
    pub fn raise_faults(&mut self, faults: Faults, now: Duration) {
        self.causes = self.causes.union(faults);
        self.faults = self.faults.union(faults);
        self.log.push(Event::Faults(self.faults));
        self.halt(ScanEndReason::Fault, now);
        self.tell_status(now);
    }

    /// Removes the cause of faults; their bits stay until the host clears them.
    pub fn mend(&mut self, faults: Faults) {
        self.causes = self.causes.without(faults);
    }

    /// Starts the firmware anew: no session, no scan, position unknown.
    pub fn reset(&mut self, cause: ResetCause, now: Duration) {
        self.boot(cause, now);
    }

    /// Presses the stop button on the device.
    pub fn press_stop(&mut self, now: Duration) {
        self.halt(ScanEndReason::Operator, now);
    }

    pub(crate) fn log(&self) -> &EventLog {
        &self.log
    }

    /// Everything that has happened and is still remembered (the last 65,536 events).
    #[must_use]
    pub fn events(&self) -> Vec<Event> {
        self.log.since(0).map(|(_, event)| event).collect()
    }
}
