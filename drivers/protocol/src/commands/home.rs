//! Finding the table's zero.

use crate::message::Request;
use crate::wire::message;

message! {
    /// Drives the table to its reference mark. Needed after each start of the device: until
    /// then the position is not known, and neither `Move` nor `Scan` is granted.
    Home = 0x06 {}
}

message! {
    /// Homing has begun. It is done when the status says idle and homed.
    HomeStarted = 0x86 {}
}

impl Request for Home {
    type Reply = HomeStarted;
}
