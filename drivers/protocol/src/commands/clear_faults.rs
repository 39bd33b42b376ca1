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

message! {
    /// Clears those of the named faults whose cause is gone, and no others: a fault that came up
    /// since the host looked stays. From version 2.
    ClearNamed = 0x0e {
        /// The faults to clear.
        faults: Faults,
    }
}

impl ClearNamed {
    /// The first version in which there is this command.
    pub const SINCE_VERSION: u8 = 2;
}

message! {
    /// The clearable ones of the named faults are cleared.
    NamedCleared = 0x8e {
        /// The faults that remain, named or not.
        remaining: Faults,
    }
}

impl Request for ClearNamed {
    type Reply = NamedCleared;
}
