//! The device's thread takes up a scan that the program was in when it last ended.

use std::sync::{Arc, Mutex};

use scanner_driver::protocol::{Calibration, Head, text};
use scanner_driver::transport::memory;
use scanner_driver::{
    ColumnSource, InterruptedScan, LinkScanner, LinkSettings, ResumeSettings, ScanInfo,
    ScanProgress, ScanStream, Scanner, ScannerError,
};

use crate::bench::{expected, plan};
use crate::device::Device;
use crate::link::{Running, connect_with, plug, unhurried};

/// What the device says when it accepts the scan.
const ACCEPTED: ScanInfo = ScanInfo {
    columns: 40,
    spacing_um: 400,
    uniform: false,
};

/// The device.
fn source() -> ColumnSource {
    ColumnSource {
        model: text("Bench"),
        serial: text("0001"),
        calibration: Calibration {
            table_count_pm: 10_000_000,
            table_origin_nm: 0,
            head: Head::Cartesian { count_pm: 10_000 },
        },
    }
}

/// What is taken up is told to whoever reads it, whether the device is there or not.
#[test]
fn a_scan_is_taken_up_before_the_device_is_there() {
    let (sockets, connector) = plug();
    let settings = LinkSettings {
        resume: Some(ResumeSettings::default()),
        ..unhurried()
    };
    let scanner = LinkScanner::start(connector, settings).unwrap();
    let mut device = Device::homed();
    device.dead_man_limit_ms = 60_000;
    let mut kept = InterruptedScan::new(source(), plan(40), ACCEPTED);
    for index in 0..25 {
        kept.add(expected(index)).unwrap();
    }
    let take_up = || scanner.take_up_scan(kept.clone());
    let mut stream = take_up().unwrap();
    assert_eq!(take_up().unwrap_err(), ScannerError::ScanRunning);
    let paused = |stream: &mut ScanStream| match stream.next_progress() {
        Ok(Some(ScanProgress::Paused(pause))) => pause,
        other => panic!("{other:?}"),
    };
    let mut told = paused(&mut stream);
    while !matches!(told.cause, ScannerError::NoSuchPort { .. }) {
        assert_eq!(
            (&told.cause, told.columns),
            (&ScannerError::ProgramEnded { before: None }, 25)
        );
        told = paused(&mut stream);
    }
    let (ours, theirs) = memory::pair();
    let running = Running::serve(Arc::new(Mutex::new(device)), theirs);
    sockets.send(ours).unwrap();
    let acknowledger = stream.acknowledger();
    for index in 25..40 {
        let column = stream.next().unwrap().unwrap();
        assert_eq!(column, expected(index));
        acknowledger.acknowledge(index);
    }
    assert_eq!(stream.next().unwrap(), None);
    drop(running);
}

#[test]
fn no_scan_is_taken_up_where_none_may_go_on() {
    let (scanner, _running, _sockets) = connect_with(
        Device::homed(),
        LinkSettings {
            resume: None,
            ..unhurried()
        },
    );
    let kept = InterruptedScan::new(source(), plan(40), ACCEPTED);
    let error = scanner.take_up_scan(kept).unwrap_err();
    assert!(matches!(error, ScannerError::NotTakenUp(_)), "{error}");
}
