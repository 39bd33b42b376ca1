//! Asking who the device is.

use crate::message::Request;
use crate::wire::{Text, message};

message! {
    /// Asks for the [`Nameplate`].
    Identify = 0x02 {}
}

message! {
    /// Who the device is.
    Nameplate = 0x82 {
        /// Name of the model.
        model: Text,
        /// Serial number.
        serial: Text,
        /// Version of the firmware.
        firmware: Text,
    }
}

impl Request for Identify {
    type Reply = Nameplate;
}
