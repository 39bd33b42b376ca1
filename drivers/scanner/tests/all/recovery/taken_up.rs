//! A scan that the program was in when it ended is taken up by the next.

use std::time::Duration;

use scanner_driver::protocol::{Calibration, Head, text};
use scanner_driver::{ColumnSource, InterruptedScan, RawColumn, ScanInfo, ScannerError};

use super::rig::{COLUMNS, MINUTE, Rig};
use crate::bench::plan;

#[test]
fn each_column_comes_once_however_often_the_program_ends() {
    let mut rig = Rig::new();
    for restart in 1..=10 {
        let homings = rig.device.homings;
        rig.program_ends(Duration::from_millis(700 * restart), None);
        rig.run_until("columns", |rig| rig.columns > 30 + 30 * restart as u32);
        assert_eq!(rig.told.len(), 1, "{:?}", rig.told);
        assert_eq!(
            rig.told[0].cause,
            ScannerError::ProgramEnded { before: None }
        );
        assert!(!rig.told[0].needs_person);
        assert_eq!(rig.device.homings, homings + 1);
    }
    rig.run_to_its_end();
}

#[test]
fn a_program_that_ended_before_the_first_column_begins_with_it() {
    let mut rig = Rig::before_any_column();
    rig.program_ends(MINUTE, None);
    rig.run_to_its_end();
}

#[test]
fn a_scan_that_is_taken_up_late_waits_for_a_person() {
    let mut rig = Rig::new();
    rig.program_ends(15 * MINUTE, None);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
    // The time that has passed already counts.
    let mut rig = Rig::new();
    rig.program_ends(14 * MINUTE, None);
    rig.plugged = false;
    rig.run_for(2 * MINUTE);
    assert!(rig.asks());
    rig.plugged = true;
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn who_waited_for_a_person_before_waits_again() {
    let mut rig = Rig::new();
    rig.program_ends(MINUTE, Some("the door is open; close it"));
    let said = "the service ended in mid-scan and has been started again; before that: the door is \
                open; close it";
    rig.run_for(MINUTE);
    assert_eq!(rig.last_told().to_string(), said);
    rig.program_ends(MINUTE, Some(said));
    rig.run_for(MINUTE);
    assert_eq!(rig.last_told().to_string(), said);
    rig.resume();
    rig.step();
    let told = rig.last_told().to_string();
    assert!(
        told.contains("by itself") && !told.contains("door"),
        "{told}"
    );
    rig.program_ends(MINUTE, Some(said));
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn an_object_moved_meanwhile_is_noticed() {
    let mut rig = Rig::new();
    rig.device.moved_counts = 50_000;
    rig.program_ends(MINUTE, None);
    let cause = rig.until_a_person_is_asked();
    assert!(matches!(cause, ScannerError::Moved { .. }), "{cause:?}");
    rig.device.moved_counts = 0;
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn another_scanner_or_another_calibration_is_not_used() {
    let mut rig = Rig::new();
    rig.device.serial = "0002";
    rig.program_ends(MINUTE, None);
    rig.run_until("other scanner", |rig| {
        let told = rig.told.last();
        told.is_some_and(|told| matches!(told.cause, ScannerError::OtherScanner { .. }))
    });
    rig.laser_seen = rig.device.laser_on;
    rig.run_for(MINUTE);
    assert!(!rig.laser_seen);
    rig.device.serial = "0001";
    rig.device.count_pm += 1;
    rig.session = None;
    rig.run_until("other calibration", |rig| {
        rig.last_told().cause == ScannerError::OtherCalibration
    });
    rig.device.count_pm -= 1;
    rig.session = None;
    rig.run_to_its_end();
}

#[test]
fn columns_are_taken_in_order_and_no_more_than_there_are() {
    let info = ScanInfo {
        columns: COLUMNS,
        spacing_um: 1,
        uniform: false,
    };
    let source = ColumnSource {
        model: text("M"),
        serial: text("1"),
        calibration: Calibration {
            table_count_pm: 1,
            table_origin_nm: 0,
            head: Head::Cartesian { count_pm: 1 },
        },
    };
    let mut scan = InterruptedScan::new(source, plan(COLUMNS), info);
    let column = |index| RawColumn {
        index,
        ..RawColumn::default()
    };
    scan.add(column(0)).unwrap();
    for wrong in [0, 2] {
        let error = scan.add(column(wrong)).unwrap_err();
        assert!(matches!(error, ScannerError::NotTakenUp(_)), "{error}");
    }
    for index in 1..COLUMNS {
        scan.add(column(index)).unwrap();
    }
    assert_eq!(scan.columns(), COLUMNS);
    assert!(scan.add(column(COLUMNS)).is_err());
}
