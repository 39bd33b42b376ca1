//! Clearing faults whose cause is gone.

use crate::faults::Faults;
use crate::message::Request;
use crate::wire::message;

message! {
    /// Clears every fault whose cause is gone.
    ClearFaults = 0x0c {}
}

message! {
    /// The clearable faults are cleared.
    FaultsCleared = 0x8c {
        /// Those that remain.
        remaining: Faults,
    }
}

impl Request for ClearFaults {
    type Reply = FaultsCleared;
}
