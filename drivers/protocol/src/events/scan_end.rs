//! The end of a scan.

use crate::faults::Faults;
use crate::wire::{codes, message};

message! {
    /// No column will be measured any more; the laser is off. Repeated until the host
    /// closes the scan, since it may get lost like any frame. Unacknowledged columns can
    /// still be asked for.
    ScanEnd = 0xc4 {
        /// The scan's number.
        scan_id: u16,
        /// Columns measured and sent: indices 0 to this less one.
        columns: u32,
        /// Why it ended.
        reason: ScanEndReason,
        /// The faults, if these ended it.
        faults: Faults,
    }
}

codes! {
    /// Why a scan ended.
    ScanEndReason {
        /// Every column has been measured.
        Complete = 0 => "complete",
        /// The host closed it early.
        Closed = 1 => "closed by the host",
        /// A fault.
        Fault = 2 => "a fault",
        /// The host was silent for longer than the dead-man time.
        DeadMan = 3 => "the host was silent for too long",
        /// Somebody pressed stop on the device.
        Operator = 4 => "stopped at the device",
    }
}
