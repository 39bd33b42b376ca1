//! A scan that a person pauses, at whatever moment.

use std::time::Duration;

use scanner_driver::ScannerError;
use scanner_driver::protocol::Faults;

use super::rig::{COLUMNS, MINUTE, Rig};
use crate::bench::STEP;

/// Bytes are under way, and the device polls but every step.
const MOMENT: Duration = Duration::from_millis(200);

/// A scan that is about to go on after a pause that ends by itself.
fn about_to_go_on() -> Rig {
    let mut rig = Rig::new();
    rig.plugged = false;
    rig.run_for(MINUTE);
    rig.plugged = true;
    rig
}

/// Steps that a scan takes from [`about_to_go_on`] to new columns.
fn steps_to_go_on() -> u32 {
    let mut rig = about_to_go_on();
    let mut steps = 0;
    let columns = rig.columns;
    while rig.columns == columns {
        rig.step();
        steps += 1;
    }
    steps
}

#[test]
fn a_pause_on_request_ends_by_a_persons_word_alone() {
    let mut rig = Rig::new();
    rig.run_until("laser", |rig| rig.device.laser_on);
    let columns = rig.columns;
    rig.pause();
    rig.run_until("laser off", |rig| !rig.device.laser_on);
    assert!(!rig.device.has_scan());
    assert_eq!(rig.told.len(), 1, "{:?}", rig.told);
    assert_eq!(rig.last_told().cause, ScannerError::PausedOnRequest);
    assert_eq!(rig.last_told().columns, columns, "between two columns");
    // Once more, nothing changes.
    rig.pause();
    rig.stays_dark();
    rig.run_for(30 * MINUTE);
    rig.stays_dark();
    assert_eq!((rig.columns, rig.told.len()), (columns, 1));
    assert_eq!(rig.device.homings, 0);
    rig.resume();
    rig.run_to_its_end();
    assert_eq!(rig.device.homings, 1);
    assert_eq!(rig.scan.pause(), Err(ScannerError::NothingToPause));
}

#[test]
fn before_the_first_column_it_waits_as_well() {
    let mut rig = Rig::before_any_column();
    rig.pause();
    rig.run_for(MOMENT);
    rig.stays_dark();
    assert_eq!(rig.columns, 0);
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn whatever_is_under_way_a_pause_is_not_lost() {
    for steps in 0..steps_to_go_on() + 3 {
        let mut rig = about_to_go_on();
        for _ in 0..steps {
            rig.step();
        }
        rig.pause();
        rig.run_for(MOMENT);
        assert!(!rig.scan.is_stopping(), "after {steps} steps");
        let columns = rig.columns;
        rig.laser_seen = rig.device.laser_on;
        rig.run_for(Duration::from_secs(5));
        assert!(!rig.laser_seen, "after {steps} steps: {:?}", rig.told);
        assert_eq!(rig.columns, columns, "after {steps} steps");
        assert_eq!(rig.last_told().cause, ScannerError::PausedOnRequest);
        rig.resume();
        rig.run_to_its_end();
    }
}

#[test]
fn whatever_is_under_way_a_word_soon_after_lets_it_go_on() {
    for steps in 0..steps_to_go_on() + 3 {
        for pause in 0..3 {
            let mut rig = about_to_go_on();
            for _ in 0..steps {
                rig.step();
            }
            rig.pause();
            for _ in 0..pause {
                rig.step();
            }
            rig.resume();
            rig.run_to_its_end();
        }
    }
}

#[test]
fn a_line_that_is_lost_meanwhile_does_not_end_the_pause() {
    for steps in [1, 10, 20, 40, 60, 80, 100] {
        let mut rig = about_to_go_on();
        for _ in 0..steps {
            rig.step();
        }
        rig.pause();
        rig.step();
        rig.plugged = false;
        rig.run_for(MINUTE);
        rig.plugged = true;
        rig.stays_dark();
        assert_eq!(rig.last_told().cause, ScannerError::PausedOnRequest);
        rig.resume();
        rig.run_to_its_end();
    }
}

#[test]
fn a_door_opened_in_the_pause_is_asked_about() {
    let mut rig = Rig::new();
    rig.pause();
    rig.run_for(MOMENT);
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.resume();
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_word_said_before_the_pause_counts_no_more() {
    let mut rig = Rig::new();
    let now = rig.now;
    rig.device.strike(Faults::INTERLOCK, now);
    rig.until_asked_about(Faults::INTERLOCK);
    rig.resume();
    rig.pause();
    rig.stays_dark();
    rig.resume();
    rig.until_asked_about(Faults::INTERLOCK);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_program_that_ends_in_the_pause_waits_again() {
    let mut rig = Rig::new();
    rig.pause();
    rig.run_for(MOMENT);
    let said = rig.last_told().to_string();
    rig.program_ends(MINUTE, Some(&said));
    rig.stays_dark();
    assert_eq!(
        rig.last_told().to_string(),
        "the service ended in mid-scan and has been started again; before that: paused on \
         request; `relief resume` lets it go on"
    );
    let told = rig.told.len();
    rig.pause();
    rig.stays_dark();
    assert_eq!(rig.told.len(), told, "a person is waited for already");
    rig.resume();
    rig.run_to_its_end();
    assert_eq!(rig.columns, COLUMNS);
}

#[test]
fn a_scan_that_is_to_be_taken_up_by_itself_can_be_paused() {
    let mut rig = Rig::new();
    rig.program_ends(STEP, None);
    rig.pause();
    // The scan of before ends with the new session.
    rig.run_for(MOMENT);
    rig.stays_dark();
    rig.resume();
    rig.run_to_its_end();
}

#[test]
fn a_scanner_that_cannot_be_reached_after_the_pause_is_told_of() {
    let mut rig = Rig::new();
    rig.pause();
    rig.run_for(MOMENT);
    let gone = ScannerError::NoSuchPort {
        port: "bench".into(),
    };
    rig.scan.unreachable(&gone);
    rig.step();
    assert_eq!(rig.last_told().cause, ScannerError::PausedOnRequest);
    rig.resume();
    rig.scan.unreachable(&gone);
    rig.step();
    assert_eq!((&rig.last_told().cause, rig.asks()), (&gone, false));
    rig.run_to_its_end();
}
