//! The answer to a request that is not granted.

use crate::wire::{codes, message};

message! {
    /// A request is not granted. Carries the request's id as tag; nothing has changed.
    Rejected = 0xbf {
        /// Kind of the request.
        request: u8,
        /// Why not.
        reason: RejectReason,
        /// More about the reason, as the reason's description says; else 0.
        detail: u32,
    }
}

codes! {
    /// Why a request is not granted.
    RejectReason {
        /// The device does not know the command.
        UnknownCommand = 1 => "the device does not know this command",
        /// The message is too short, too long, or has a forbidden value.
        Malformed = 2 => "the device could not read the command",
        /// No `Hello` since the device started.
        NoSession = 3 => "the device has been restarted and no session is open",
        /// No version in common; `detail` holds the device's oldest version in bits 0 to 7
        /// and the newest in bits 8 to 15.
        Version = 4 => "no protocol version in common",
        /// Something else is going on: a move, homing, or a scan.
        Busy = 5 => "the device is busy",
        /// The table's position is not known; home first.
        NotHomed = 6 => "the table has not been homed",
        /// The table would leave its limits.
        TableLimit = 7 => "the table would leave its limits",
        /// A lateral would leave its limits.
        AngleLimit = 8 => "an angle is outside the device's limits",
        /// Too many columns; `detail` is the most allowed.
        TooManyColumns = 9 => "too many columns for this device",
        /// Too many samples; `detail` is the most allowed.
        TooManySamples = 10 => "too many samples in a column for this device",
        /// The exposure is outside the limits.
        Exposure = 11 => "the exposure is outside the device's limits",
        /// A number that must not be 0 is 0.
        Zero = 12 => "a step or a count is zero",
        /// A fault prevents it; `detail` holds the fault bits.
        Faulted = 13 => "a fault prevents it",
        /// The device has no such function.
        NotSupported = 14 => "the device has no such function",
    }
}
