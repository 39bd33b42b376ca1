//! A pause on request, through the driver's thread.

use scanner_driver::{
    LinkScanner, ResumeSettings, ScanProgress, ScanStream, Scanner, ScannerError,
};

use crate::bench::{expected, plan};
use crate::device::Device;
use crate::link::{Running, connect, connect_with, eventually, unhurried};

fn connect_resumable() -> (LinkScanner, Running, impl Sized) {
    let settings = scanner_driver::LinkSettings {
        resume: Some(ResumeSettings::default()),
        ..unhurried()
    };
    connect_with(Device::homed(), settings)
}

/// Takes and acknowledges columns, to the end or to a pause; says whether it was a pause.
fn take(stream: &mut ScanStream, columns: &mut u32, most: u32) -> bool {
    let acknowledger = stream.acknowledger();
    while *columns < most {
        match stream.next_progress().unwrap() {
            Some(ScanProgress::Column(column)) => {
                assert_eq!(column, expected(*columns));
                acknowledger.acknowledge(column.index);
                *columns += 1;
            }
            Some(ScanProgress::Paused(pause)) if pause.needs_person => {
                assert_eq!(pause.cause, ScannerError::PausedOnRequest);
                assert_eq!(pause.columns, *columns, "between two columns");
                return true;
            }
            Some(_) => {}
            None => return false,
        }
    }
    false
}

#[test]
fn the_laser_is_off_when_a_pause_is_answered() {
    let (scanner, running, _sockets) = connect_resumable();
    assert_eq!(scanner.pause_scan(), Err(ScannerError::NothingToPause));
    let mut stream = scanner.start_scan(&plan(100)).unwrap();
    let mut columns = 0;
    for pauses in 1..=3 {
        assert!(!take(&mut stream, &mut columns, 10 * pauses));
        scanner.pause_scan().unwrap();
        {
            let device = running.device.lock().unwrap();
            assert!(!device.laser_on);
            assert!(!device.has_scan());
        }
        assert!(take(&mut stream, &mut columns, u32::MAX));
        // It stands still already.
        scanner.pause_scan().unwrap();
        scanner.resume_scan().unwrap();
    }
    assert!(!take(&mut stream, &mut columns, u32::MAX));
    assert_eq!(columns, 100);
    assert_eq!(scanner.pause_scan(), Err(ScannerError::NothingToPause));
    assert_eq!(running.device.lock().unwrap().homings, 3);
}

#[test]
fn a_scan_that_could_not_go_on_is_not_paused() {
    let (scanner, running, _sockets) = connect(Device::homed());
    let mut stream = scanner.start_scan(&plan(60)).unwrap();
    let mut columns = 0;
    take(&mut stream, &mut columns, 5);
    let refused = scanner.pause_scan().unwrap_err();
    assert!(matches!(refused, ScannerError::CannotPause(_)));
    assert!(refused.to_string().contains("`resume`"), "{refused}");
    assert!(!take(&mut stream, &mut columns, u32::MAX));
    assert_eq!(columns, 60);
    eventually("laser off", || !running.device.lock().unwrap().laser_on);
}

#[test]
fn of_a_scanner_that_is_gone_the_pause_says_so_and_holds() {
    let (scanner, mut running, _sockets) = connect_resumable();
    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    running.pull();
    let mut columns = 0;
    // Nobody can say that the laser is off.
    let unheard = scanner.pause_scan().unwrap_err();
    assert!(
        !matches!(
            unheard,
            ScannerError::NothingToPause | ScannerError::CannotPause(_)
        ),
        "{unheard}"
    );
    assert!(take(&mut stream, &mut columns, u32::MAX));
}

#[test]
fn an_abort_ends_a_scan_that_is_paused_on_request() {
    let (scanner, _running, _sockets) = connect_resumable();
    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    scanner.pause_scan().unwrap();
    scanner.abort().unwrap();
    let end = loop {
        match stream.next() {
            Ok(column) => assert!(column.is_some()),
            Err(error) => break error,
        }
    };
    assert_eq!(end, ScannerError::Aborted);
    assert_eq!(scanner.pause_scan(), Err(ScannerError::NothingToPause));
}
