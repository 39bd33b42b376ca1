//! Scans over good lines and bad ones.

use std::time::Duration;

use scanner_driver::protocol::commands::Scan;
use scanner_driver::protocol::{Faults, Frame};
use scanner_driver::session::{Answer, Command};
use scanner_driver::{LinkSettings, ScannerError};

use crate::bench::{Bench, Mishaps, plan};
use crate::device::Device;

#[test]
fn every_column_comes_once_and_in_order() {
    let mut bench = Bench::ready(Device::homed());
    assert_eq!(bench.scan(100), Ok(()));
    bench.assert_columns(100);
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.has_scan(), "the scan was not closed");
    assert!(!bench.device.laser_on);
    assert_eq!(bench.session.line().resends, 0);
    assert_eq!(bench.session.line().retries, 0);
}

#[test]
fn scans_follow_each_other() {
    let mut bench = Bench::ready(Device::homed());
    for _ in 0..3 {
        bench.columns.clear();
        assert_eq!(bench.scan(20), Ok(()));
        bench.assert_columns(20);
    }
    assert_eq!(bench.device.scans, 3);
}

#[test]
fn a_second_scan_waits_for_the_first() {
    let mut bench = Bench::ready(Device::homed());
    assert!(matches!(
        bench.run(Command::Scan(plan(50))),
        Ok(Answer::Scan(_))
    ));
    assert_eq!(
        bench.run(Command::Scan(plan(50))),
        Err(ScannerError::ScanRunning)
    );
    bench.run_until("end", |bench| bench.over.is_some());
    bench.assert_columns(50);
}

#[test]
fn each_mishap_alone_is_mended() {
    let kinds = [
        (
            "lose",
            Mishaps {
                lose: 0.1,
                ..Mishaps::default()
            },
        ),
        (
            "repeat",
            Mishaps {
                repeat: 0.3,
                ..Mishaps::default()
            },
        ),
        (
            "corrupt",
            Mishaps {
                corrupt: 0.1,
                ..Mishaps::default()
            },
        ),
        (
            "swap",
            Mishaps {
                swap: 0.3,
                ..Mishaps::default()
            },
        ),
        (
            "garbage",
            Mishaps {
                garbage: 0.2,
                ..Mishaps::default()
            },
        ),
    ];
    for (name, mishaps) in kinds {
        let mut bench = Bench::ready(Device::homed());
        bench.mishaps = mishaps;
        assert_eq!(bench.scan(60), Ok(()), "{name}");
        bench.assert_columns(60);
    }
}

#[test]
fn all_mishaps_together_are_mended() {
    for seed in 0..25 {
        let mut bench = Bench::with(Device::homed(), LinkSettings::default(), seed);
        bench.mishaps = Mishaps {
            lose: 0.05,
            repeat: 0.05,
            corrupt: 0.03,
            swap: 0.05,
            garbage: 0.05,
        };
        assert_eq!(bench.scan(60), Ok(()), "seed {seed}");
        bench.assert_columns(60);
        assert_eq!(bench.device.scans, 1, "seed {seed}");
        assert!(bench.session.line().resends > 0, "seed {seed}");
    }
}

#[test]
fn the_tail_of_a_scan_is_asked_for_when_nothing_follows_it() {
    let mut bench = Bench::ready(Device::homed());
    assert!(bench.run(Command::Scan(plan(12))).is_ok());
    bench.run_until("columns", |bench| bench.columns.len() == 10);
    bench.cut = true;
    bench.run_until("the last column", |bench| bench.device.sent_columns() == 12);
    bench.run_for(Duration::from_millis(100));
    bench.cut = false;
    bench.run_until("end", |bench| bench.over.is_some());
    assert_eq!(bench.over, Some(Ok(())));
    bench.assert_columns(12);
}

#[test]
fn no_more_columns_are_sent_than_there_is_credit_for() {
    for (ours, theirs) in [(8, 100), (100, 8)] {
        let settings = LinkSettings {
            credits: ours,
            ..LinkSettings::default()
        };
        let device = Device {
            max_credits: theirs,
            columns_per_poll: 50,
            ..Device::homed()
        };
        let mut bench = Bench::with(device, settings, 1);
        bench.acknowledge = false;
        assert!(bench.run(Command::Scan(plan(40))).is_ok());
        // Longer than the longest wait for a column: it is the host who holds things up.
        bench.run_for(Duration::from_secs(60));
        assert_eq!(bench.device.sent_columns(), 8);
        assert_eq!(bench.columns.len(), 8);
        // Out of order: nothing is granted before the first is safe.
        let now = bench.now;
        bench.session.acknowledge(1, now);
        bench.run_for(Duration::from_secs(1));
        assert_eq!(bench.device.sent_columns(), 8);
        bench.session.acknowledge(0, now);
        bench.run_for(Duration::from_secs(1));
        assert_eq!(bench.device.sent_columns(), 10);
        bench.acknowledge = true;
        for index in 2..10 {
            let now = bench.now;
            bench.session.acknowledge(index, now);
        }
        bench.run_until("end", |bench| bench.over.is_some());
        bench.assert_columns(40);
        assert_eq!(bench.device.most_unacknowledged, 8);
    }
}

#[test]
fn an_unacknowledged_scan_stays_open_at_the_device() {
    let mut bench = Bench::ready(Device::homed());
    bench.acknowledge = false;
    assert_eq!(bench.scan(10), Ok(()));
    bench.run_for(Duration::from_secs(2));
    assert!(bench.device.has_scan());
    for index in (0..10).rev() {
        let now = bench.now;
        bench.session.acknowledge(index, now);
    }
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.has_scan());
}

#[test]
fn a_lost_grant_is_repeated() {
    let mut bench = Bench::ready(Device::homed());
    bench.mishaps = Mishaps {
        lose: 0.5,
        ..Mishaps::default()
    };
    let settings_allow = bench.scan(40);
    assert_eq!(settings_allow, Ok(()));
    bench.assert_columns(40);
}

#[test]
fn closing_a_scan_early_turns_the_laser_off() {
    let mut bench = Bench::ready(Device::homed());
    assert!(bench.run(Command::Scan(plan(1_000))).is_ok());
    bench.run_until("columns", |bench| bench.columns.len() > 20);
    bench.session.close_scan();
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.laser_on && !bench.device.has_scan());
    assert_eq!(bench.over, None);
    assert_eq!(bench.device.faults, Faults::NONE);
}

#[test]
fn a_scan_that_a_late_request_began_and_ended_is_closed() {
    let mut bench = Bench::ready(Device::homed());
    assert_eq!(bench.scan(3), Ok(()));
    bench.run_until("close", |bench| !bench.device.has_scan());
    // The line brings another request of old; all its columns are sent before anybody looks.
    let late = Scan {
        scan_id: 4_321,
        credits: 16,
        plan: plan(3),
    };
    let now = bench.now;
    bench.device.receive(Frame::new(999, &late).as_bytes(), now);
    bench.run_until("end", |bench| !bench.device.is_measuring());
    assert!(bench.device.has_scan());
    bench.run_until("close", |bench| !bench.device.has_scan());
    assert_eq!(bench.columns.len(), 3, "nobody has asked for those");
}
