//! The simulator on a real pseudo-terminal, with a host made of plain reads and writes.

#![allow(clippy::panic)] // A test that panics has failed.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use scanner_protocol::commands::{GetLimits, Grant, Hello, Home, Scan};
use scanner_protocol::{Decoder, DeviceMessage, Frame, MAX_VERSION, MIN_VERSION, Message};
use sim_scanner::config::SimConfig;
use sim_scanner::device::Event;
use sim_scanner::preset::Overrides;

/// Only keeps a broken test from hanging.
const LIMIT: Duration = Duration::from_secs(20);

struct Host {
    port: File,
    decoder: Decoder,
    tag: u16,
    waiting: Vec<DeviceMessage>,
}

impl Host {
    fn open(port: &Path) -> Self {
        let port = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(rustix::fs::OFlags::NOCTTY.bits() as i32)
            .open(port)
            .expect("the port opens");
        Self {
            port,
            decoder: Decoder::new(),
            tag: 0,
            waiting: Vec::new(),
        }
    }

    fn send<M: Message>(&mut self, message: &M) {
        self.tag += 1;
        let frame = Frame::new(self.tag, message);
        self.port.write_all(frame.as_bytes()).expect("taken");
    }

    fn next(&mut self) -> DeviceMessage {
        loop {
            if !self.waiting.is_empty() {
                return self.waiting.remove(0);
            }
            let mut buffer = [0; 4096];
            let count = self.port.read(&mut buffer).expect("the device is there");
            let mut bytes = &buffer[..count];
            while let Some(packet) = self.decoder.next(&mut bytes) {
                self.waiting
                    .push(DeviceMessage::decode(&packet).expect("well formed"));
            }
        }
    }

    fn until<T>(&mut self, wanted: impl Fn(&DeviceMessage) -> Option<T>) -> T {
        loop {
            if let Some(found) = wanted(&self.next()) {
                return found;
            }
        }
    }

    /// A session on a homed device.
    fn get_ready(&mut self, control: &sim_scanner::control::Control) {
        self.send(&Hello {
            min_version: MIN_VERSION,
            max_version: MAX_VERSION,
            dead_man_ms: 30_000,
        });
        self.until(|m| matches!(m, DeviceMessage::HelloReply(_)).then_some(()));
        self.send(&Home {});
        control
            .wait_until(LIMIT, |device| device.homed)
            .expect("homes");
    }

    /// Asks for the proposed scan, with leave to send this many columns.
    fn start_scan(&mut self, credits: u16) {
        self.send(&GetLimits {});
        let plan = self.until(|m| match m {
            DeviceMessage::Limits(limits) => Some(limits.proposed),
            _ => None,
        });
        self.send(&Scan {
            scan_id: 1,
            credits,
            plan,
        });
    }

    /// The proposed scan to its end; gives the number of samples.
    fn scan(&mut self) -> usize {
        self.start_scan(16);
        let mut samples = 0;
        loop {
            match self.next() {
                DeviceMessage::ColumnFragment(fragment) => samples += fragment.len(),
                DeviceMessage::ColumnEnd(end) => self.send(&Grant {
                    scan_id: 1,
                    acknowledged_below: end.column + 1,
                    send_below: end.column + 17,
                }),
                DeviceMessage::ScanEnd(_) => return samples,
                _ => {}
            }
        }
    }
}

fn config(columns: u32) -> SimConfig {
    let mut config = SimConfig {
        overrides: Overrides {
            columns: Some(columns),
            samples: Some(100),
            ..Overrides::default()
        },
        ..SimConfig::default()
    };
    config.device.table_speed_mm_s = f64::INFINITY;
    config
}

#[test]
fn a_scan_comes_whole_and_the_link_goes_at_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("scanner");
    std::os::unix::fs::symlink("/nowhere", &link).expect("an old link");
    let server = config(30).serve_pty(Some(&link)).expect("a pty");
    assert_eq!(fs::read_link(&link).expect("a link"), server.port());
    let mut host = Host::open(&link);
    host.get_ready(&server.control());
    assert_eq!(host.scan(), 30 * 100);
    drop(server);
    assert!(fs::symlink_metadata(&link).is_err(), "the link is gone");
}

#[test]
fn a_file_in_the_links_place_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("scanner");
    fs::write(&link, "mine").expect("a file");
    let error = config(3).serve_pty(Some(&link)).expect_err("occupied");
    assert!(error.to_string().contains("not a symbolic link"), "{error}");
    assert_eq!(fs::read_to_string(&link).expect("still there"), "mine");
}

#[test]
fn the_device_outlives_the_hosts_that_come_and_go() {
    let server = config(10).serve_pty(None).expect("a pty");
    let mut control = server.control();
    for _ in 0..3 {
        let mut host = Host::open(server.port());
        host.get_ready(&control);
        assert_eq!(host.scan(), 10 * 100);
        drop(host);
        // The next host finds the port as a closed one, whatever was on its way.
        control.skip_events();
    }
}

#[test]
fn a_host_that_does_not_read_blocks_neither_itself_nor_the_device() {
    let server = config(200).serve_pty(None).expect("a pty");
    let mut control = server.control();
    let mut host = Host::open(server.port());
    host.get_ready(&control);
    host.start_scan(64);
    control
        .wait_for(LIMIT, |event| matches!(event, Event::ColumnSent(_)))
        .expect("columns come");
    // Nothing is read; the device still hears.
    host.send(&scanner_protocol::commands::Abort {});
    control
        .wait_for(LIMIT, |event| *event == Event::Aborted)
        .expect("the abort is heard past the full buffer");
    assert!(!control.snapshot().laser_on);
    host.until(|m| matches!(m, DeviceMessage::Aborted(_)).then_some(()));
}

#[test]
fn a_test_can_stall_step_and_wait_for_what_happens() {
    let server = config(10).serve_pty(None).expect("a pty");
    let mut control = server.control();
    let mut host = Host::open(server.port());
    host.get_ready(&control);
    control.step_columns(Some(4));
    host.start_scan(64);
    control
        .wait_for(LIMIT, |event| *event == Event::ColumnSent(3))
        .expect("four columns");
    let held = control
        .wait_until(LIMIT, |device| !device.laser_on)
        .expect("the laser waits with the table");
    assert_eq!(held.columns_sent, 4);
    control.step_columns(None);
    control
        .wait_for(LIMIT, |event| matches!(event, Event::ScanEnded(_)))
        .expect("the rest");
    assert_eq!(control.snapshot().columns_sent, 10);

    control.stall();
    let frames = control.snapshot().frames_received;
    host.send(&GetLimits {});
    let silent = control.wait_until(Duration::from_millis(50), |d| d.frames_received > frames);
    assert!(silent.is_err(), "a stalled device hears nothing");
    control.resume();
    control
        .wait_until(LIMIT, |d| d.frames_received > frames)
        .expect("it hears again");
}

#[test]
fn paper_columns_all_come() {
    // 240 columns of 256 samples with the preset's noise, all of which must come. How fast is
    // printed; nothing is asked of it.
    let mut config = SimConfig::default();
    config.device.table_speed_mm_s = f64::INFINITY;
    let server = config.serve_pty(None).expect("a pty");
    let mut host = Host::open(server.port());
    host.get_ready(&server.control());
    let start = Instant::now();
    assert_eq!(host.scan(), 240 * 256);
    println!("{:.0} columns/s", 240.0 / start.elapsed().as_secs_f64());
}
