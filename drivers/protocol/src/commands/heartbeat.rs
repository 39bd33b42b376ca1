//! Telling the device that the host lives, and asking how it does.

use crate::events::Status;
use crate::message::Request;
use crate::wire::message;

message! {
    /// Asks for the [`Status`].
    ///
    /// Any good frame from the host restarts the dead-man time; this one is sent when
    /// there is nothing else to say. It changes nothing, so that it need not be remembered
    /// for retries.
    Heartbeat = 0x05 {}
}

impl Request for Heartbeat {
    type Reply = Status;
}
