//! What came to version 1 later: taking up an interrupted scan. Devices without it answer
//! that they do not know the command.
//!
//! DO NOT EDIT THE BYTES IN THIS FILE, for the reasons given in `v1`.

use scanner_protocol::commands::{Continue, ScanContinued, ScanPlan};

use super::v1::check;

#[test]
fn continuing() {
    check(
        15,
        Continue {
            scan_id: 2,
            credits: 33,
            first_column: 119,
            plan: ScanPlan {
                first_table_counts: -6_000,
                pitch_counts: 50,
                columns: 240,
                first_angle_counts: -80_000,
                angle_step_counts: 650,
                samples: 256,
                exposure_us: 0,
            },
        },
        "00 03 0d 0f 02 02 02 21 02 77 01 01 06 90 e8 ff ff 32 01 01 02 f0 01 01 07 80 c7 fe ff 8a 02 01 01 02 01 01 01 01 05 0e 73 24 5a 00",
    );
    check(
        15,
        ScanContinued {
            scan_id: 2,
            columns: 240,
            spacing_um: 488,
            uniform: true,
        },
        "00 03 8d 0f 02 02 02 f0 01 01 03 e8 01 01 06 01 fd 92 c7 db 00",
    );
}
