//! Opening a session and agreeing on a version.

use crate::message::Request;
use crate::wire::message;

message! {
    /// Opens a session: the device ends whatever it was doing (laser off, table stopped,
    /// scan forgotten) and forgets earlier request ids.
    ///
    /// This message and its replies keep their bytes in every version.
    Hello = 0x01 {
        /// Oldest version the host speaks.
        min_version: u8,
        /// Newest version the host speaks.
        max_version: u8,
        /// The dead-man time the host wishes, milliseconds.
        dead_man_ms: u16,
    }
}

message! {
    /// The session is open.
    HelloReply = 0x81 {
        /// The newest version that both speak; it holds until the next `Hello`.
        version: u8,
        /// A number that differs at each start of the device.
        boot_id: u32,
        /// The dead-man time in force: the one wished, brought within the device's limits.
        dead_man_ms: u16,
    }
}

impl Request for Hello {
    type Reply = HelloReply;
}
