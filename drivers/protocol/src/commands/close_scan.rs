//! Ending a scan in good order.

use crate::message::Request;
use crate::wire::message;

message! {
    /// The host has every column it wants: the device forgets the scan and stops repeating
    /// [`crate::ScanEnd`]. A scan still running is ended first. Granted also when the
    /// device knows no such scan.
    CloseScan = 0x0a {
        /// The scan's number.
        scan_id: u16,
    }
}

message! {
    /// The scan is forgotten.
    ScanClosed = 0x8a {
        /// The scan's number.
        scan_id: u16,
    }
}

impl Request for CloseScan {
    type Reply = ScanClosed;
}
