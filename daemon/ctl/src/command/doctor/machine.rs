//! The machine: programs that disturb serial ports, and the clock.

use std::fs;
use std::path::Path;

use jiff::Timestamp;
use jiff::civil::date;

use super::finding::Finding;

const CLOCK: &str = "clock";

/// Programs that open any serial port they see, and what keeps them away.
const DISTURBERS: [(&str, &str); 2] = [
    (
        "ModemManager",
        "a udev rule with ENV{ID_MM_DEVICE_IGNORE}=\"1\" for the scanner keeps it away; or \
         systemctl disable --now ModemManager",
    ),
    (
        "brltty",
        "it takes USB serial adapters for Braille displays: remove it, or systemctl mask \
         brltty-udev.service",
    ),
];

/// Which of the known disturbers run.
pub(super) fn disturbers() -> Vec<Finding> {
    let running = running_programs();
    let found: Vec<Finding> = DISTURBERS
        .iter()
        .filter(|(name, _)| running.iter().any(|program| program == name))
        .map(|(name, remedy)| {
            Finding::doubtful(
                "other programs",
                format!("{name} runs and may open the scanner's port"),
                *remedy,
            )
        })
        .collect();
    if found.is_empty() {
        return vec![Finding::good(
            "other programs",
            "none that disturbs serial ports",
        )];
    }
    found
}

fn running_programs() -> Vec<String> {
    let Ok(processes) = fs::read_dir("/proc") else {
        return Vec::new();
    };
    processes
        .flatten()
        .filter_map(|process| fs::read_to_string(process.path().join("comm")).ok())
        .map(|name| name.trim().to_owned())
        .collect()
}

/// Whether the clock can be right: scans are named after it.
pub(super) fn clock() -> Finding {
    let now = Timestamp::now();
    let remedy = "set it (timedatectl set-ntp true): scans are named and sorted by time";
    let sane = date(2026, 1, 1).to_zoned(jiff::tz::TimeZone::UTC);
    if sane.is_ok_and(|sane| now < sane.timestamp()) {
        return Finding::bad(CLOCK, format!("it says {now}, which is long past"), remedy);
    }
    let keeper = Path::new("/run/systemd/timesync");
    if keeper.is_dir() && !keeper.join("synchronized").exists() {
        return Finding::doubtful(
            CLOCK,
            format!("it says {now}, but is not synchronised"),
            remedy,
        );
    }
    Finding::good(CLOCK, format!("{now}"))
}
