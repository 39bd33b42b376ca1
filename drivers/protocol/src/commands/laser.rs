//! Switching the laser by hand, for adjustment.

use crate::message::Request;
use crate::wire::message;

message! {
    /// Switches the laser, as for adjustment. A scan switches it by itself.
    SetLaser = 0x08 {
        /// Whether it is to be on.
        on: bool,
    }
}

message! {
    /// The laser is as asked.
    LaserSet = 0x88 {
        /// Whether it is on.
        on: bool,
    }
}

impl Request for SetLaser {
    type Reply = LaserSet;
}
