//! A recorded scan over the wire gives the host the numbers that reading the file gives.

#![allow(clippy::panic)] // A test that panics has failed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use scan_files::{PointScan, ReadOptions};
use scanner_protocol::commands::{GetLimits, Grant, Hello, Home, Scan};
use scanner_protocol::{
    Calibration, Decoder, DeviceMessage, Frame, Head, MAX_VERSION, MIN_VERSION, Message,
};
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::memory::MemoryLink;
use sim_scanner::replay::Replay;
use sim_scanner::source::Source;

struct Host {
    link: MemoryLink,
    decoder: Decoder,
    tag: u16,
}

impl Host {
    fn send<M: Message>(&mut self, message: &M) {
        self.tag += 1;
        self.link.send(Frame::new(self.tag, message).as_bytes());
        self.link.pass(Duration::from_secs(3));
    }

    fn told(&mut self) -> Vec<DeviceMessage> {
        let bytes = self.link.take();
        let mut bytes = bytes.as_slice();
        let mut messages = Vec::new();
        while let Some(packet) = self.decoder.next(&mut bytes) {
            messages.push(DeviceMessage::decode(&packet).expect("well formed"));
        }
        messages
    }
}

/// x, and y and z with intensity of each sample.
type Column = (f64, Vec<(f64, f64, u8)>);

/// The columns as a host puts them together.
fn scanned(replay: Replay) -> Vec<Column> {
    let settings = DeviceSettings {
        table_speed_mm_s: f64::INFINITY,
        ..DeviceSettings::default()
    };
    let source = Source::Replay(replay);
    let Calibration {
        table_count_pm,
        table_origin_nm,
        head: Head::Cartesian { count_pm },
    } = source.calibration()
    else {
        panic!("recordings are Cartesian")
    };
    let table_mm = |counts: i32| {
        table_origin_nm as f64 / 1e6 + f64::from(counts) * (f64::from(table_count_pm) / 1e9)
    };
    let count_mm = f64::from(count_pm) / 1e9;
    let mut host = Host {
        link: MemoryLink::new(source, settings, 1),
        decoder: Decoder::new(),
        tag: 0,
    };
    host.send(&Hello {
        min_version: MIN_VERSION,
        max_version: MAX_VERSION,
        dead_man_ms: 30_000,
    });
    host.send(&Home {});
    host.send(&GetLimits {});
    let plan = host
        .told()
        .into_iter()
        .find_map(|message| match message {
            DeviceMessage::Limits(limits) => Some(limits.proposed),
            _ => None,
        })
        .expect("limits are told");
    host.send(&Scan {
        scan_id: 2,
        credits: 64,
        plan,
    });
    let mut columns: Vec<Column> = Vec::new();
    let mut samples = Vec::new();
    loop {
        for message in host.told() {
            match message {
                DeviceMessage::ColumnFragment(fragment) => {
                    samples.extend(fragment.samples().map(|sample| {
                        (
                            f64::from(sample.lateral_counts) * count_mm,
                            f64::from(sample.reading.range_counts) * count_mm,
                            sample.reading.intensity,
                        )
                    }));
                }
                DeviceMessage::ColumnEnd(end) => {
                    columns.push((table_mm(end.table_counts), core::mem::take(&mut samples)));
                }
                DeviceMessage::ScanEnd(end) => {
                    assert_eq!(end.columns as usize, columns.len());
                    return columns;
                }
                DeviceMessage::Rejected(rejected) => panic!("{rejected:?}"),
                _ => {}
            }
        }
        let done = columns.len() as u32;
        host.send(&Grant {
            scan_id: 2,
            acknowledged_below: done,
            send_below: done + 64,
        });
    }
}

fn read(scan: &PointScan) -> Vec<Column> {
    scan.columns
        .iter()
        .map(|column| {
            let samples = column.samples.iter();
            (
                column.x_mm,
                samples.map(|s| (s.y_mm, s.z_mm, s.intensity)).collect(),
            )
        })
        .collect()
}

#[test]
fn points_with_odd_coordinates_come_back_bit_for_bit() {
    let points = (0..200).flat_map(|i| {
        (0..40).map(move |j| {
            let x = f64::from(i) * 0.293 - 17.0;
            let y = f64::from(j) * 1.37 + f64::from((i * 7 + j * 13) % 11) * 0.01;
            [x, y, (x * 0.37).sin() * 20.0 + y * 0.123_456]
        })
    });
    let scan = scan_files::from_points_mm(points, "waves", &ReadOptions::default())
        .expect("points enough");
    let replay = Replay::new(&scan).expect("small");
    assert_eq!(scanned(replay), read(&scan));
}

#[test]
fn real_scans_come_back_bit_for_bit() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let files: [PathBuf; 2] = [
        data.join("stanford_bunny/bun000.ply.gz"),
        data.join("stanford_happy/happyStandRight_0.ply.gz"),
    ];
    for file in files {
        if !file.exists() {
            println!("skipped: {} is not here", file.display());
            continue;
        }
        let scan = scan_files::read(&file, &ReadOptions::default()).expect("readable");
        let replay = Replay::open(&file).expect("readable");
        assert_eq!(scanned(replay), read(&scan), "{}", file.display());
    }
}

#[test]
fn a_file_that_is_no_scan_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("words.xyz");
    std::fs::write(&file, "these are no numbers\nnor are these\n").expect("written");
    let error = Replay::open(&file).expect_err("no scan").to_string();
    assert!(error.contains("words.xyz"), "{error}");
}
