//! The simulated scanner of all checks, and a scan of it.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use scanner_driver::transport::usb::{UsbDevice, list};
use scanner_driver::{LinkScanner, LinkSettings, RawColumn, Scanner, ScannerError, UsbSettings};
use sim_scanner::config::SimConfig;
use sim_scanner::preset::Overrides;

use crate::memory::MemoryConnector;

/// Longest wait for anything: the machine is emulated, and may have little of its host.
pub(crate) const LIMIT: Duration = Duration::from_secs(30);

/// Columns in flight.
const CREDITS: u16 = 16;

/// Columns that are taken before the plug is pulled: with those in flight, not all.
const COLUMNS_BEFORE_CUT: usize = 10;

/// Small enough for an emulated machine to trace in a second.
pub(crate) const COLUMNS: u32 = 40;
pub(crate) const SAMPLES: u32 = 96;

pub(crate) fn config() -> SimConfig {
    SimConfig {
        overrides: Overrides {
            columns: Some(COLUMNS),
            samples: Some(SAMPLES),
            ..Overrides::default()
        },
        seed: 1,
        ..SimConfig::default()
    }
}

pub(crate) fn usb() -> UsbSettings {
    UsbSettings {
        serial: Some(config().device.serial),
        link: link(),
        ..UsbSettings::default()
    }
}

/// As patient as an emulated machine needs, and with credit for a part of the scan only.
pub(crate) fn link() -> LinkSettings {
    LinkSettings {
        request_timeout: Duration::from_secs(1),
        dead_man: Duration::from_secs(10),
        silence: Duration::from_secs(12),
        credits: CREDITS,
        ..LinkSettings::default()
    }
}

/// Waits for the scanner, homes it and scans as it proposes.
pub(crate) fn whole_scan(scanner: &dyn Scanner) -> Result<Vec<RawColumn>> {
    wait_for(scanner)?;
    scanner.home().context("homing")?;
    let mut stream = scanner.start_scan(&plan(scanner)?).context("start")?;
    let acknowledger = stream.acknowledger();
    let mut columns = Vec::new();
    while let Some(column) = stream.next().context("in the scan")? {
        acknowledger.acknowledge(column.index);
        columns.push(column);
    }
    Ok(columns)
}

pub(crate) fn plan(scanner: &dyn Scanner) -> Result<scanner_protocol::ScanPlan> {
    Ok(scanner.identify().context("identify")?.limits.proposed)
}

/// Waits until the scanner can be talked to; the time that took.
pub(crate) fn wait_for(scanner: &dyn Scanner) -> Result<Duration> {
    let start = Instant::now();
    loop {
        match scanner.identify() {
            Ok(_) => return Ok(start.elapsed()),
            Err(error) if start.elapsed() > LIMIT => {
                return Err(error).context("it does not come");
            }
            Err(_) => std::thread::sleep(Duration::from_millis(50)),
        }
    }
}

/// The columns that every way must bring.
pub(crate) fn reference() -> Result<&'static [RawColumn]> {
    static COLUMNS_IN_MEMORY: OnceLock<Vec<RawColumn>> = OnceLock::new();
    if let Some(columns) = COLUMNS_IN_MEMORY.get() {
        return Ok(columns);
    }
    let config = config();
    let connector = MemoryConnector::new(config.source()?, config.device, config.seed);
    let scanner = LinkScanner::start(connector, link())?;
    let columns = whole_scan(&scanner).context("in memory")?;
    ensure!(
        columns.len() == COLUMNS as usize,
        "{} columns",
        columns.len()
    );
    let samples: usize = columns.iter().map(|column| column.samples.len()).sum();
    ensure!(samples > 1000, "only {samples} samples");
    Ok(COLUMNS_IN_MEMORY.get_or_init(|| columns))
}

/// A whole scan, held against the one in memory.
pub(crate) fn scan_is_exact(scanner: &dyn Scanner) -> Result<()> {
    let reference = reference()?;
    let columns = whole_scan(scanner)?;
    if columns == reference {
        return Ok(());
    }
    let differs = columns.iter().zip(reference).position(|(a, b)| a != b);
    bail!(
        "{} columns instead of {}, and the first that differs is {differs:?}",
        columns.len(),
        reference.len()
    );
}

/// Begins a scan, pulls the plug in its midst, and sees how it ends.
pub(crate) fn scan_is_cut(
    scanner: &dyn Scanner,
    unplug: impl FnOnce() -> Result<()>,
) -> Result<()> {
    let reference = reference()?;
    wait_for(scanner)?;
    scanner.home().context("homing")?;
    let mut stream = scanner.start_scan(&plan(scanner)?).context("start")?;
    let acknowledger = stream.acknowledger();
    let mut unplug = Some(unplug);
    let mut columns = 0;
    let end = loop {
        match stream.next() {
            Ok(Some(column)) => {
                ensure!(Some(&column) == reference.get(columns), "column {columns}");
                columns += 1;
                if columns < COLUMNS_BEFORE_CUT {
                    acknowledger.acknowledge(column.index);
                } else if let Some(unplug) = unplug.take() {
                    // Without credit for the rest, the scan cannot end before the plug is out.
                    unplug()?;
                }
            }
            Ok(None) => bail!("the scan ended as if nothing had happened"),
            Err(error) => break error,
        }
    };
    ensure!(
        matches!(end, ScannerError::LostConnection { .. }),
        "it ended with {end}"
    );
    Ok(())
}

/// The simulator as the driver lists it, once it is there.
pub(crate) fn listed() -> Result<UsbDevice> {
    let start = Instant::now();
    loop {
        let found = list()?.into_iter().find(|device| usb().fits(device));
        if let Some(device) = found.filter(|device| device.scanner_interface().is_some()) {
            return Ok(device);
        }
        ensure!(start.elapsed() < LIMIT, "it does not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}
