//! A scan that goes on after the cable was out.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use scanner_driver::transport::memory::{self, MemoryTransport};
use scanner_driver::{
    LinkScanner, LinkSettings, ResumeSettings, ScanProgress, ScanStream, Scanner, ScannerError,
};

use crate::bench::{expected, plan};
use crate::device::Device;
use crate::link::{Running, connect_with, eventually, unhurried};

fn connect(device: Device) -> (LinkScanner, Running, Sender<MemoryTransport>) {
    let settings = LinkSettings {
        resume: Some(ResumeSettings::default()),
        ..unhurried()
    };
    connect_with(device, settings)
}

/// Puts the cable back.
fn plug(running: &Running, sockets: &Sender<MemoryTransport>) -> Running {
    let (ours, theirs) = memory::pair();
    sockets.send(ours).unwrap();
    Running::serve(Arc::clone(&running.device), theirs)
}

fn until_paused(stream: &mut ScanStream, columns: &mut u32) {
    loop {
        match stream.next_progress().unwrap().expect("not the end") {
            ScanProgress::Column(column) => {
                assert_eq!(column, expected(*columns));
                *columns += 1;
            }
            ScanProgress::Paused(pause) => {
                assert!(!pause.needs_person, "{pause}");
                assert_eq!(pause.columns, *columns, "between two columns");
                return;
            }
            // The end of an earlier pause.
            ScanProgress::Resumed => {}
        }
    }
}

#[test]
fn every_column_comes_once_however_often_the_cable_is_pulled() {
    let (scanner, mut running, sockets) = connect(Device {
        max_credits: 6,
        ..Device::homed()
    });
    let mut stream = scanner.start_scan(&plan(60)).unwrap();
    let acknowledger = stream.acknowledger();
    let mut columns = 0;
    for _ in 0..5 {
        running.pull();
        until_paused(&mut stream, &mut columns);
        running = plug(&running, &sockets);
        // What came before the pause is acknowledged only now: the device must not send more
        // than there is room for.
        for index in 0..columns {
            acknowledger.acknowledge(index);
        }
        let resumed = stream.next_progress().unwrap();
        assert_eq!(resumed, Some(ScanProgress::Resumed));
    }
    while let Some(column) = stream.next().unwrap() {
        assert_eq!(column, expected(columns));
        acknowledger.acknowledge(column.index);
        columns += 1;
    }
    assert_eq!(columns, 60);
    // The host knows of the last column before the device has turned to what comes after it.
    eventually("laser off", || !running.device.lock().unwrap().laser_on);
    assert_eq!(running.device.lock().unwrap().homings, 5);
}

#[test]
fn a_paused_scan_is_aborted_at_once() {
    let (scanner, mut running, sockets) = connect(Device::homed());
    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    running.pull();
    until_paused(&mut stream, &mut 0);
    assert_eq!(
        scanner.start_scan(&plan(4)).unwrap_err(),
        ScannerError::ScanRunning
    );
    // Nobody hears the abort; the scan is over all the same.
    assert!(scanner.abort().is_err());
    assert_eq!(stream.next(), Err(ScannerError::Aborted));
    assert_eq!(scanner.resume_scan(), Err(ScannerError::NothingPaused));
    let _again = plug(&running, &sockets);
    while scanner.identify().is_err() {}
    let mut next = scanner.start_scan(&plan(4)).unwrap();
    assert_eq!(next.next(), Ok(Some(expected(0))));
}
