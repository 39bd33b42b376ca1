//! The device has started.

use crate::wire::{codes, message};

message! {
    /// Sent once when the device starts: it knows of no session, and not where the table
    /// is. Keeps its bytes in every version.
    Banner = 0xc0 {
        /// Oldest version the device speaks.
        min_version: u8,
        /// Newest version the device speaks.
        max_version: u8,
        /// A number that differs at each start.
        boot_id: u32,
        /// Why it started.
        cause: ResetCause,
    }
}

codes! {
    /// Why a device started.
    ResetCause {
        /// It was switched on.
        PowerOn = 0 => "power on",
        /// Its watchdog barked.
        Watchdog = 1 => "watchdog",
        /// The supply voltage dropped.
        BrownOut = 2 => "brown-out",
        /// It was told to, or its firmware was renewed.
        Software = 3 => "software",
    }
}
