//! Acknowledging columns and granting credit.

use crate::wire::message;

message! {
    /// Acknowledges columns and grants credit. Not answered.
    ///
    /// Both numbers are absolute, so that a lost, doubled or late one does no harm: the
    /// device takes the greatest it has seen.
    Grant = 0x40 {
        /// The scan's number.
        scan_id: u16,
        /// Every column below this index is safe with the host: the device may forget it.
        acknowledged_below: u32,
        /// The device may send columns below this index. Never more than
        /// `acknowledged_below` plus the device's `max_credits`.
        send_below: u32,
    }
}
