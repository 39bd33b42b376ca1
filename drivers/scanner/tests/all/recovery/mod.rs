//! A scan across interruptions under simulated time: who lets it go on, and when the laser may
//! be on again.

mod on_request;
mod rig;
mod taken_up;

use std::time::Duration;

use scanner_driver::ScannerError;
use scanner_driver::protocol::{Activity, Faults};

use rig::{MINUTE, Mishap, Rig};

#[test]
fn a_short_pause_ends_by_itself_and_a_long_one_waits_for_a_person() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(14 * MINUTE);
    assert!(!rig.last_told().needs_person);
    rig.plugged = true;
    rig.run_until("columns", |rig| rig.columns > 80);
    rig.plugged = false;
    rig.run_for(14 * MINUTE);
    assert!(!rig.last_told().needs_person);
    rig.run_for(MINUTE);
    assert!(rig.last_told().needs_person);
    rig.plugged = true;
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_computer_that_was_suspended_for_long_asks_a_person_first() {
    let mut rig = Rig::new();
    rig.sleep(60 * MINUTE);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
    // Nor may the time pass while the table is homed.
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(15 * MINUTE - Duration::from_millis(500));
    rig.plugged = true;
    rig.run_until("homing", |rig| rig.device.homings == 1);
    rig.stays_dark();
}

#[test]
fn the_last_columns_measured_again_show_the_laser_as_well_as_new_ones() {
    let mut rig = Rig::new();
    rig.device.columns_per_poll = 1;
    rig.plugged = false;
    rig.run_for(20 * MINUTE);
    assert!(rig.asks());
    rig.plugged = true;
    rig.resume();
    let columns = rig.columns;
    rig.run_until("going on", |rig| rig.resumed > 0);
    assert_eq!(rig.columns, columns, "a new column has come already");
    rig.told.clear();
    rig.plugged = false;
    rig.run_for(14 * MINUTE);
    assert!(!rig.asks(), "{:?}", rig.told);
    rig.plugged = true;
    rig.run_to_its_end();
}

#[test]
fn columns_that_a_sleeping_computer_finds_in_its_buffers_are_no_news() {
    let mut rig = Rig::new();
    rig.run_until("columns", |rig| rig.columns > 20);
    let before = rig.columns;
    rig.sleep_while_the_line_keeps(60 * MINUTE);
    rig.step();
    assert!(rig.columns > before, "the line kept none");
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn after_ten_attempts_a_person_is_asked() {
    let mut rig = Rig::new();
    rig.mishap = Mishap::StallsAlways;
    let scans = rig.device.scans;
    let cause = rig.until_a_person_is_asked();
    assert_eq!(cause, ScannerError::Fault(Faults::TABLE_STALL));
    assert_eq!(rig.device.scans, scans + 10);
    rig.mishap = Mishap::None;
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_scanner_calibrated_anew_is_waited_for_and_not_used() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.device.count_pm += 1;
    rig.laser_seen = false;
    rig.run_for(MINUTE);
    assert!(!rig.laser_seen);
    let told = rig.last_told();
    assert_eq!(
        (told.needs_person, &told.cause),
        (false, &ScannerError::OtherCalibration)
    );
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.count_pm -= 1;
    rig.plugged = true;
    rig.run_to_its_end();
}

#[test]
fn a_word_said_before_the_door_was_opened_does_not_count() {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(MINUTE);
    // This pause would have ended by itself.
    rig.resume();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_word_about_another_fault_does_not_count() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::LIMIT_SWITCH, now);
    rig.until_a_person_is_asked();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.resume();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.plugged = true;
    let both = Faults::LIMIT_SWITCH | Faults::INTERLOCK;
    rig.until_asked_about(both);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_word_is_used_up_by_the_homing_that_follows_it() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_asked_about(Faults::INTERLOCK);
    rig.resume();
    rig.run_until("homing", |rig| rig.device.activity == Activity::Homing);
    // The door is opened once more, and closed, while the cable is out.
    rig.plugged = false;
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_door_opened_between_homing_and_going_on_asks_a_person() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_a_person_is_asked();
    rig.mishap = Mishap::DoorBeforeContinue;
    rig.resume();
    rig.run_until("door", |rig| rig.mishap == Mishap::None);
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn another_scanner_does_not_end_the_wait_for_a_person() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_a_person_is_asked();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.serial = "0002";
    rig.plugged = true;
    rig.run_until("other scanner", |rig| {
        matches!(rig.last_told().cause, ScannerError::OtherScanner { .. })
    });
    rig.stays_dark();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.device.serial = "0001";
    rig.plugged = true;
    rig.stays_dark();
    // What was told first has been seen as well.
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn an_object_moved_while_nothing_was_in_view_is_noticed() {
    let mut rig = Rig::new();
    rig.device.gap = 100..300;
    rig.run_until("gap", |rig| rig.columns > 250);
    rig.plugged = false;
    // Half a millimetre.
    rig.device.moved_counts = 50_000;
    rig.run_for(MINUTE);
    rig.plugged = true;
    let cause = rig.until_a_person_is_asked();
    assert!(matches!(cause, ScannerError::Moved { .. }), "{cause:?}");
    assert!(rig.columns < 300);
    rig.run_until("laser off", |rig| !rig.device.laser_on);
    rig.stays_dark();
    rig.device.moved_counts = 0;
    rig.resume();
    rig.run_to_its_end();
}
