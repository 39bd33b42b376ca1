//! Version 1, as devices in the field speak it.
//!
//! DO NOT EDIT THE BYTES IN THIS FILE. They were computed apart from this crate. If a test
//! here fails, the change that made it fail is wrong: devices that speak version 1 would no
//! longer be understood. A new version gets a file of its own beside this one; messages that
//! came to version 1 later stand at the end.

use scanner_protocol::commands::*;
use scanner_protocol::events::*;
use scanner_protocol::{Faults, text};

use super::check;

/// What the host says.
#[test]
fn host_messages() {
    check(
        1,
        Hello {
            min_version: 1,
            max_version: 1,
            dead_man_ms: 2_000,
        },
        "00 03 01 01 09 01 01 d0 07 81 5a 65 56 00",
    );
    check(2, Identify {}, "00 03 02 02 05 fe 6f f3 ce 00");
    check(3, GetCalibration {}, "00 03 03 03 05 88 34 2a d6 00");
    check(4, GetLimits {}, "00 03 04 04 05 ca b4 24 9c 00");
    check(5, Heartbeat {}, "00 03 05 05 05 bc ef fd 84 00");
    check(6, Home {}, "00 03 06 06 05 26 02 96 ad 00");
    check(
        7,
        Move {
            table_counts: -6_000,
        },
        "00 03 07 07 09 90 e8 ff ff 0b a3 59 e1 00",
    );
    check(8, SetLaser { on: true }, "00 03 08 08 06 01 dd 96 e4 9d 00");
    check(
        9,
        Scan {
            scan_id: 1,
            credits: 32,
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
        "00 03 09 09 02 01 02 20 06 90 e8 ff ff 32 01 01 02 f0 01 01 07 80 c7 fe ff 8a 02 01 01 02 01 01 01 01 05 61 49 21 e6 00",
    );
    check(
        10,
        CloseScan { scan_id: 1 },
        "00 03 0a 0a 02 01 05 99 3e 34 fa 00",
    );
    check(11, Abort {}, "00 03 0b 0b 05 38 ef e0 10 00");
    check(12, ClearFaults {}, "00 03 0c 0c 05 7a 6f ee 5a 00");
    check(
        13,
        Grant {
            scan_id: 1,
            acknowledged_below: 8,
            send_below: 40,
        },
        "00 03 40 0d 02 01 02 08 01 01 02 28 01 01 05 9d 21 f7 75 00",
    );
    check(
        14,
        Resend {
            scan_id: 1,
            column: 8,
            missing: Missing::of([3, 8, 11]),
        },
        "00 03 41 0e 02 01 02 08 01 01 02 03 08 02 21 01 e3 95 01 32 00",
    );
}

/// What the device says.
#[test]
fn device_messages() {
    check(
        1,
        HelloReply {
            version: 1,
            boot_id: 0x1f2e_3d4c,
            dead_man_ms: 2_000,
        },
        "00 03 81 01 0c 01 4c 3d 2e 1f d0 07 62 cf a1 32 00",
    );
    check(
        2,
        Nameplate {
            model: text("ST-750"),
            serial: text("000123"),
            firmware: text("1.4.0"),
        },
        "00 03 82 02 19 06 53 54 2d 37 35 30 06 30 30 30 31 32 33 05 31 2e 34 2e 30 1a ff e0 29 00",
    );
    check(
        3,
        Calibration {
            table_count_pm: 10_000_000,
            table_origin_nm: -60_000_000,
            head: Head::Polar {
                camera_y_nm: 0,
                camera_z_nm: 750_000_000,
                angle_count_prad: 1_000_000,
                range_count_pm: 100_000_000,
            },
        },
        "00 03 83 03 04 80 96 98 01 08 79 6c fc ff ff ff ff 01 01 01 01 01 01 01 01 05 80 17 b4 2c 01 01 01 04 40 42 0f 01 08 e1 f5 05 8c c7 56 05 00",
    );
    check(
        3,
        Calibration {
            table_count_pm: 333_333,
            table_origin_nm: 0,
            head: Head::Cartesian { count_pm: 10_000 },
        },
        "00 03 83 03 04 15 16 05 01 01 01 01 01 01 01 01 04 01 10 27 01 05 88 a2 6e 5d 00",
    );
    check(
        4,
        Limits {
            table_min_counts: -10_000,
            table_max_counts: 10_000,
            lateral_min_counts: -200_000,
            lateral_max_counts: 200_000,
            max_line_rate_millihz: 50_000,
            max_columns: 100_000,
            max_samples: 1_024,
            max_credits: 64,
            min_exposure_us: 100,
            max_exposure_us: 20_000,
            min_dead_man_ms: 500,
            max_dead_man_ms: 10_000,
            proposed: ScanPlan {
                first_table_counts: -6_000,
                pitch_counts: 50,
                columns: 240,
                first_angle_counts: -80_000,
                angle_step_counts: 650,
                samples: 256,
                exposure_us: 0,
            },
        },
        "00 03 84 04 07 f0 d8 ff ff 10 27 01 08 c0 f2 fc ff 40 0d 03 03 50 c3 01 04 a0 86 01 01 03 04 40 02 64 01 01 03 20 4e 01 0a f4 01 10 27 90 e8 ff ff 32 01 01 02 f0 01 01 07 80 c7 fe ff 8a 02 01 01 02 01 01 01 01 05 5c 84 a4 7f 00",
    );
    check(
        5,
        Status {
            boot_id: 0x1f2e_3d4c,
            uptime_ms: 65_536,
            activity: Activity::Scanning,
            homed: true,
            laser_on: true,
            faults: Faults::NONE,
            table_counts: -5_600,
            temperature_cdegc: 3_150,
            scan_id: 1,
            columns: 8,
        },
        "00 03 85 05 05 4c 3d 2e 1f 01 02 01 04 03 01 01 01 01 01 08 20 ea ff ff 4e 0c 01 02 08 01 01 05 d5 e1 4e cb 00",
    );
    check(6, HomeStarted {}, "00 03 86 06 05 a6 19 a3 4c 00");
    check(7, MoveStarted {}, "00 03 87 07 05 d0 42 7a 54 00");
    check(8, LaserSet { on: true }, "00 03 88 08 06 01 e6 20 bd 70 00");
    check(
        9,
        ScanAccepted {
            scan_id: 1,
            columns: 240,
            spacing_um: 488,
            uniform: true,
        },
        "00 03 89 09 02 01 02 f0 01 01 03 e8 01 01 06 01 3a a4 6c fb 00",
    );
    check(
        10,
        ScanClosed { scan_id: 1 },
        "00 03 8a 0a 02 01 05 0b 8e d2 4b 00",
    );
    check(11, Aborted {}, "00 03 8b 0b 05 b8 f4 d5 f1 00");
    check(
        12,
        FaultsCleared {
            remaining: Faults::INTERLOCK,
        },
        "00 03 8c 0c 02 10 01 01 05 1c c8 01 f5 00",
    );
    check(
        9,
        Rejected {
            request: 9,
            reason: RejectReason::TooManySamples,
            detail: 1_024,
        },
        "00 03 bf 09 03 09 0a 02 04 01 05 7c e1 2d 04 00",
    );
    check(
        1,
        Banner {
            min_version: 1,
            max_version: 1,
            boot_id: 0x1f2e_3d4c,
            cause: ResetCause::BrownOut,
        },
        "00 03 c0 01 0c 01 01 4c 3d 2e 1f 02 e9 3b a0 6f 00",
    );
    check(
        2,
        StatusChanged(Status {
            boot_id: 0x1f2e_3d4c,
            uptime_ms: 70_000,
            activity: Activity::Faulted,
            homed: true,
            laser_on: false,
            faults: Faults::LASER | Faults::INTERLOCK,
            table_counts: -5_600,
            temperature_cdegc: i16::MIN,
            scan_id: 1,
            columns: 8,
        }),
        "00 03 c1 02 08 4c 3d 2e 1f 70 11 01 03 05 01 02 11 01 01 05 20 ea ff ff 03 80 01 02 08 01 01 05 62 10 7c 49 00",
    );
    check(
        3,
        ColumnFragment {
            scan_id: 1,
            column: 8,
            fragment: 0,
            fragments: 18,
            first_sample: 0,
            table_counts: -5_600,
            laterals: Laterals::Uniform {
                first_counts: -80_000,
                step_counts: 650,
                readings: [
                    Reading {
                        range_counts: 7_421,
                        intensity: 200,
                        no_return: false,
                        saturated: false,
                    },
                    Reading::NO_RETURN,
                    Reading {
                        range_counts: 7_423,
                        intensity: 255,
                        no_return: false,
                        saturated: true,
                    },
                ]
                .into_iter()
                .collect(),
            },
        },
        "00 03 c2 03 02 01 02 08 01 01 01 01 02 12 01 01 05 20 ea ff ff 08 03 80 c7 fe ff 8a 02 01 03 fd 1c 01 02 c8 01 01 01 01 01 04 01 ff 1c 01 07 ff 02 a6 58 ba bd 00",
    );
    check(
        4,
        ColumnFragment {
            scan_id: 1,
            column: 9,
            fragment: 1,
            fragments: 2,
            first_sample: 10,
            table_counts: -5_550,
            laterals: Laterals::Listed(
                [
                    Sample {
                        lateral_counts: -4_120,
                        reading: Reading {
                            range_counts: -310,
                            intensity: 90,
                            no_return: false,
                            saturated: false,
                        },
                    },
                    Sample {
                        lateral_counts: -3_987,
                        reading: Reading {
                            range_counts: -302,
                            intensity: 91,
                            no_return: false,
                            saturated: false,
                        },
                    },
                ]
                .into_iter()
                .collect(),
            ),
        },
        "00 03 c2 04 02 01 02 09 01 01 02 01 02 02 02 0a 10 52 ea ff ff 01 02 e8 ef ff ff ca fe ff ff 5a 0a 6d f0 ff ff d2 fe ff ff 5b 05 ce cf fe 32 00",
    );
    check(
        5,
        ColumnEnd {
            scan_id: 1,
            column: 8,
            table_counts: -5_600,
            fragments: 18,
            samples: 256,
        },
        "00 03 c3 05 02 01 02 08 01 01 06 20 ea ff ff 12 01 06 01 76 16 f4 61 00",
    );
    check(
        6,
        ScanEnd {
            scan_id: 1,
            columns: 240,
            reason: ScanEndReason::Complete,
            faults: Faults::NONE,
        },
        "00 03 c4 06 02 01 02 f0 01 01 01 01 01 01 01 05 48 2d 40 fd 00",
    );
}

/// Taking up an interrupted scan came later: devices without it answer that they do not know
/// the command.
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
