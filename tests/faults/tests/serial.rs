//! Scans over a pseudo-terminal whose bits turn over, with the goodput that is left.
//!
//! `cargo test -p relief-faults --test serial -- --nocapture` shows the figures; they are of
//! this machine, and nothing is asked of them.

// A helper that unwraps fails its test, as it should.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use std::time::{Duration, Instant};

use scanner_driver::{
    LinkSettings, RawColumn, ResumeSettings, ScanProgress, Scanner, SerialScanner, SerialSettings,
};
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::fault::FaultSpec;
use sim_scanner::preset::Overrides;

const COLUMNS: u32 = 120;

/// Bytes of a sample on the wire.
const SAMPLE_BYTES: usize = 6;

fn config(faults: &str) -> SimConfig {
    let faults: FaultSpec = faults.parse().unwrap();
    let mut config = SimConfig {
        overrides: Overrides {
            columns: Some(COLUMNS),
            samples: Some(128),
            ..Overrides::default()
        },
        line: faults.line,
        ..SimConfig::default()
    };
    config.device.mishaps = faults.device;
    config.device.table_speed_mm_s = f64::INFINITY;
    config
}

fn settings(port: &std::path::Path) -> SerialSettings {
    let mut settings = SerialSettings::new(port.display().to_string());
    settings.link = LinkSettings {
        resume: Some(ResumeSettings::default()),
        // A pause is for a pulled cable, not for a busy machine.
        dead_man: Duration::from_secs(10),
        ..LinkSettings::default()
    };
    settings
}

struct Scanned {
    columns: Vec<RawColumn>,
    pauses: u32,
    took: Duration,
    bytes: u64,
}

/// A whole scan; `at` is told each column before it is acknowledged.
fn scan(faults: &str, mut at: impl FnMut(&Control, u32)) -> Scanned {
    let server = config(faults).serve_pty(None).unwrap();
    let control = server.control();
    let scanner = SerialScanner::open(settings(server.port())).unwrap();
    let plan = scanner.identify().unwrap().limits.proposed;
    scanner.home().unwrap();
    let start = Instant::now();
    let mut stream = scanner.start_scan(&plan).unwrap();
    let acknowledger = stream.acknowledger();
    let (mut columns, mut pauses) = (Vec::new(), 0);
    while let Some(progress) = stream.next_progress().unwrap() {
        match progress {
            ScanProgress::Column(column) => {
                at(&control, column.index);
                acknowledger.acknowledge(column.index);
                columns.push(column);
            }
            ScanProgress::Paused(pause) => {
                assert!(!pause.needs_person, "{pause}");
                pauses += 1;
            }
            ScanProgress::Resumed => {}
        }
    }
    let scanned = Scanned {
        columns,
        pauses,
        took: start.elapsed(),
        bytes: control.line_use().to_host_bytes,
    };
    drop(stream);
    drop(scanner);
    control
        .wait_until(Duration::from_secs(60), |device| !device.laser_on)
        .expect("laser off");
    scanned
}

fn report(name: &str, scanned: &Scanned) {
    let payload: usize = scanned
        .columns
        .iter()
        .map(|column| (column.samples.len() + column.dropouts as usize) * SAMPLE_BYTES)
        .sum();
    println!(
        "{name}: goodput {:.0} kB/s, {:.0} % of the bytes sent; {} pauses",
        payload as f64 / scanned.took.as_secs_f64() / 1e3,
        100.0 * payload as f64 / scanned.bytes as f64,
        scanned.pauses
    );
}

#[test]
fn turned_bits_cost_time_and_no_sample() {
    let clean = scan("", |_, _| {});
    report("no errors", &clean);
    assert_eq!(clean.columns.len(), COLUMNS as usize);
    assert_eq!(clean.pauses, 0);
    for rate in ["1e-5", "1e-4"] {
        for seed in 1..=3 {
            let scanned = scan(&format!("flip={rate},seed={seed}"), |_, _| {});
            report(&format!("1 bit in {rate}, seed {seed}"), &scanned);
            assert_eq!(scanned.columns, clean.columns, "{rate}, seed {seed}");
        }
    }
}

#[test]
fn a_serial_cable_pulled_in_the_midst_is_got_over() {
    let clean = scan("", |_, _| {});
    let pulled = scan("", |control, column| {
        if column == 40 {
            control.unplug();
            // Longer than the silence after which the driver gives the line up.
            let control = control.clone();
            std::thread::spawn(move || {
                std::thread::sleep(LinkSettings::default().silence + Duration::from_secs(1));
                control.replug();
            });
        }
    });
    report("pulled for 4 s", &pulled);
    assert!(pulled.pauses > 0);
    assert_eq!(pulled.columns, clean.columns);
}
