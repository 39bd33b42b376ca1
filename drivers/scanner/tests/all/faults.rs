//! Scans that do not reach their end.

use std::time::Duration;

use scanner_driver::protocol::Faults;
use scanner_driver::session::{Answer, Command};
use scanner_driver::{LinkSettings, ScannerError};

use crate::bench::{Bench, Mishaps, plan};
use crate::device::Device;

/// A bench in the middle of a long scan.
fn amid_a_scan() -> Bench {
    let mut bench = Bench::ready(Device::homed());
    assert!(bench.run(Command::Scan(plan(1_000))).is_ok());
    bench.run_until("columns", |bench| bench.columns.len() > 20);
    bench
}

fn end_of(bench: &mut Bench) -> ScannerError {
    bench.run_until("end", |bench| bench.over.is_some());
    bench.over.take().unwrap().unwrap_err()
}

#[test]
fn an_abort_stops_device_and_stream() {
    let mut bench = amid_a_scan();
    assert_eq!(bench.run(Command::Abort), Ok(Answer::Done));
    assert_eq!(end_of(&mut bench), ScannerError::Aborted);
    assert!(!bench.device.laser_on && !bench.device.is_measuring());
    bench.columns.clear();
    assert_eq!(bench.scan(10), Ok(()));
    bench.assert_columns(10);
}

#[test]
fn an_abort_gets_through_a_bad_line() {
    for seed in 0..20 {
        let mut bench = Bench::with(Device::homed(), LinkSettings::default(), seed);
        bench.run_until("ready", |bench| bench.ready > 0);
        assert!(bench.run(Command::Scan(plan(1_000))).is_ok());
        bench.mishaps = Mishaps {
            lose: 0.3,
            corrupt: 0.1,
            ..Mishaps::default()
        };
        assert_eq!(bench.run(Command::Abort), Ok(Answer::Done), "seed {seed}");
        assert!(!bench.device.laser_on, "seed {seed}");
    }
}

#[test]
fn an_abort_also_calls_off_a_scan_not_yet_accepted() {
    let mut bench = Bench::ready(Device::homed());
    // The scan command is lost; were it repeated, the laser would go on after the abort.
    bench.mishaps.lose = 1.0;
    let scan = bench.command(Command::Scan(plan(10)));
    bench.run_for(Duration::from_millis(50));
    bench.mishaps.lose = 0.0;
    assert_eq!(bench.run(Command::Abort), Ok(Answer::Done));
    assert_eq!(bench.outcome(scan), Some(Err(ScannerError::Aborted)));
    bench.run_for(Duration::from_secs(5));
    assert_eq!(bench.device.scans, 0);
}

#[test]
fn an_abort_ends_a_homing() {
    let mut bench = Bench::ready(Device::new());
    let homing = bench.command(Command::Home);
    bench.run_for(Duration::from_millis(100));
    assert_eq!(bench.run(Command::Abort), Ok(Answer::Done));
    assert_eq!(bench.outcome(homing), Some(Err(ScannerError::Aborted)));
}

#[test]
fn a_restart_is_noticed_by_its_banner_or_without() {
    for with_banner in [true, false] {
        let mut bench = amid_a_scan();
        bench.device.reboot(with_banner);
        let error = end_of(&mut bench);
        assert!(
            matches!(error, ScannerError::Restarted { .. }),
            "{with_banner}: {error:?}"
        );
        assert!(error.to_string().contains("homed again"));
        bench.run_until("ready again", |bench| bench.ready == 2);
        bench.columns.clear();
        assert!(bench.scan(5).is_err(), "the table's position is not known");
        assert_eq!(bench.run(Command::Home), Ok(Answer::Done));
        assert_eq!(bench.scan(5), Ok(()));
        bench.assert_columns(5);
    }
}

#[test]
fn the_columns_before_a_fault_are_kept() {
    let mut bench = amid_a_scan();
    let now = bench.now;
    bench.device.strike(Faults::LASER | Faults::INTERLOCK, now);
    let sent = bench.device.sent_columns();
    let error = end_of(&mut bench);
    assert_eq!(
        error,
        ScannerError::Fault(Faults::LASER | Faults::INTERLOCK)
    );
    assert_eq!(
        error.to_string(),
        "the scanner reports: laser fault, interlock open"
    );
    bench.assert_columns(sent);
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.has_scan());
}

#[test]
fn a_host_that_sleeps_finds_the_laser_off() {
    let mut bench = amid_a_scan();
    // The host does nothing for longer than the dead-man time.
    for _ in 0..500 {
        bench.now += Duration::from_millis(5);
        let now = bench.now;
        let frames = bench.device.poll(now);
        for frame in frames {
            bench.session.receive(frame.as_bytes(), Duration::ZERO);
        }
        let _ = bench.session.take_output();
    }
    assert!(!bench.device.laser_on && !bench.device.is_measuring());
    assert_eq!(end_of(&mut bench), ScannerError::DeadMan);
}

#[test]
fn a_device_that_announces_too_much_is_refused() {
    for columns in [0, 800_001, u32::MAX] {
        let mut bench = Bench::ready(Device {
            announce: Some(columns),
            ..Device::homed()
        });
        let error = bench.scan(10).unwrap_err();
        assert!(
            matches!(error, ScannerError::Protocol(_)),
            "{columns}: {error:?}"
        );
        bench.run_for(Duration::from_secs(1));
        assert!(!bench.device.laser_on, "{columns}");
    }
}

#[test]
fn a_scan_shorter_than_announced_is_an_error() {
    let mut bench = Bench::ready(Device {
        announce: Some(30),
        ..Device::homed()
    });
    let error = bench.scan(10).unwrap_err();
    assert!(matches!(error, ScannerError::Protocol(_)), "{error:?}");
    bench.assert_columns(10);
}

#[test]
fn a_column_that_never_makes_sense_ends_the_scan() {
    let mut bench = Bench::ready(Device {
        contradictory: true,
        ..Device::homed()
    });
    let error = bench.scan(10).unwrap_err();
    assert_eq!(
        error,
        ScannerError::ColumnLost {
            column: 3,
            attempts: 12
        }
    );
    bench.assert_columns(3);
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.laser_on);
}

#[test]
fn a_device_that_stops_sending_columns_is_given_up() {
    let mut bench = amid_a_scan();
    bench.device.columns_per_poll = 0;
    let error = end_of(&mut bench);
    assert!(
        matches!(
            error,
            ScannerError::Timeout {
                awaited: "column",
                ..
            }
        ),
        "{error:?}"
    );
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.laser_on);
}

#[test]
fn losing_the_line_ends_the_stream() {
    let mut bench = amid_a_scan();
    bench.cut = true;
    let error = end_of(&mut bench);
    assert!(
        matches!(error, ScannerError::LostConnection { .. }),
        "{error:?}"
    );
    assert!(bench.lost.is_some());
    bench.run_for(Duration::from_secs(5));
    assert!(!bench.device.laser_on, "the dead-man time has passed");
}

#[test]
fn a_fault_that_is_over_does_not_keep_the_next_scan_from_starting() {
    let mut bench = amid_a_scan();
    let now = bench.now;
    bench.device.strike(Faults::INTERLOCK, now);
    assert_eq!(end_of(&mut bench), ScannerError::Fault(Faults::INTERLOCK));
    // The door is closed again; the bit is still set.
    bench.columns.clear();
    assert_eq!(bench.scan(10), Ok(()));
    bench.assert_columns(10);
    assert_eq!(bench.run(Command::Home), Ok(Answer::Done));
}

#[test]
fn a_fault_that_lasts_is_told() {
    let mut bench = amid_a_scan();
    let now = bench.now;
    bench.device.lasting = Faults::INTERLOCK;
    bench.device.strike(Faults::INTERLOCK, now);
    assert_eq!(end_of(&mut bench), ScannerError::Fault(Faults::INTERLOCK));
    assert_eq!(bench.scan(10), Err(ScannerError::Fault(Faults::INTERLOCK)));
    assert_eq!(
        bench.run(Command::Home),
        Err(ScannerError::Fault(Faults::INTERLOCK))
    );
    assert_eq!(bench.device.scans, 1);
}

#[test]
fn a_fault_that_comes_up_before_the_clearing_is_seen_first() {
    let mut bench = Bench::ready(Device::new());
    let now = bench.now;
    bench.device.strike(Faults::TABLE_STALL, now);
    // Between the refusal, which tells of the table alone, and the clearing.
    bench.device.before_clearing = Faults::INTERLOCK;
    assert_eq!(
        bench.run(Command::Home),
        Err(ScannerError::Fault(Faults::INTERLOCK))
    );
    assert_eq!(bench.device.faults, Faults::INTERLOCK);
    assert_eq!(bench.device.homings, 0);
    // Told of it, whoever homes again has seen it.
    assert_eq!(bench.run(Command::Home), Ok(Answer::Done));
    assert_eq!(bench.device.faults, Faults::NONE);
}

#[test]
fn a_device_of_version_1_has_its_faults_cleared_as_ever() {
    let mut device = Device::new();
    device.version = 1;
    let mut bench = Bench::ready(device);
    let now = bench.now;
    bench.device.strike(Faults::TABLE_STALL, now);
    assert_eq!(bench.run(Command::Home), Ok(Answer::Done));
    let now = bench.now;
    bench.device.strike(Faults::LIMIT_SWITCH, now);
    let named = Command::ClearFaults(Faults::LIMIT_SWITCH);
    assert_eq!(bench.run(named), Ok(Answer::Done));
    assert_eq!(bench.device.faults, Faults::NONE);
}
