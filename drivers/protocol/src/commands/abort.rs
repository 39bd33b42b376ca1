//! Stopping everything at once.

use crate::message::Request;
use crate::wire::message;

message! {
    /// Laser off, table stopped, scan forgotten, at once and in any state, without a
    /// session too. It changes nothing when repeated, so that it need not be remembered
    /// for retries, and may be sent while another request is open.
    Abort = 0x0b {}
}

message! {
    /// All has stopped.
    Aborted = 0x8b {}
}

impl Request for Abort {
    type Reply = Aborted;
}
