//! Version 2, as devices in the field speak it: what it has beside version 1, whose messages it
//! keeps.
//!
//! DO NOT EDIT THE BYTES IN THIS FILE. They were computed apart from this crate. If a test
//! here fails, the change that made it fail is wrong: devices that speak version 2 would no
//! longer be understood. A new version gets a file of its own beside this one.

use scanner_protocol::commands::*;
use scanner_protocol::events::*;
use scanner_protocol::{Faults, MAX_VERSION, MIN_VERSION};

use super::check;

#[test]
fn the_versions_are_offered() {
    assert_eq!((MIN_VERSION, MAX_VERSION), (1, 2));
    check(
        1,
        Hello {
            min_version: 1,
            max_version: 2,
            dead_man_ms: 2_000,
        },
        "00 03 01 01 09 01 02 d0 07 d8 e4 23 54 00",
    );
    check(
        1,
        HelloReply {
            version: 2,
            boot_id: 523_124_044,
            dead_man_ms: 2_000,
        },
        "00 03 81 01 0c 02 4c 3d 2e 1f d0 07 ff d5 49 03 00",
    );
    check(
        1,
        Banner {
            min_version: 1,
            max_version: 2,
            boot_id: 523_124_044,
            cause: ResetCause::BrownOut,
        },
        "00 03 c0 01 0c 01 02 4c 3d 2e 1f 02 47 49 34 e9 00",
    );
}

#[test]
fn faults_are_cleared_by_name() {
    check(
        14,
        ClearNamed {
            faults: Faults::INTERLOCK | Faults::TABLE_STALL,
        },
        "00 03 0e 0e 02 18 01 01 05 23 ba f4 62 00",
    );
    check(
        14,
        NamedCleared {
            remaining: Faults::INTERLOCK,
        },
        "00 03 8e 0e 02 10 01 01 05 3e 78 56 2f 00",
    );
}
