//! How fast each way to the scanner is, and who waits for whom.
//!
//! The simulated device sends a recording, which takes it no time to measure, over a way to the
//! driver, which acknowledges every column at once. Both ends keep account of their waiting:
//!
//! - **The device waits for the host** while it holds bytes that the way does not take, or has no
//!   credit for the next column.
//! - **The host waits for the device** while the driver's thread is in a read and nothing is there.
//!
//! Shares are of the time from the first column that reached the driver's user to the last.

mod case;
mod host;
mod memory;
mod row;

pub use case::{Case, Encoding};
pub use memory::memory;
pub use row::{Row, TABLE_HEAD};

use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use scanner_driver::transport::Connector;
use scanner_driver::transport::serial::{SerialConnector, SerialSettings};
use scanner_driver::{LinkScanner, LinkSettings, Scanner};
use sim_scanner::config::SimConfig;
use sim_scanner::control::{Control, LineUse};
use sim_scanner::device::DeviceSettings;
use sim_scanner::source::Source;

use host::{HostUse, Watched};

/// Longest wait for the scanner to be there.
const LIMIT: Duration = Duration::from_secs(30);

/// A device at the other end of a way.
pub struct Attached {
    /// Opens the way.
    pub connector: Box<dyn Connector>,
    /// What the device has sent and waited for so far, and how many frames it has sent again.
    pub account: Box<dyn Fn() -> (LineUse, u64)>,
    /// What is dropped when the device is no longer needed.
    pub device: Box<dyn Any>,
}

impl Attached {
    /// A device whose control side tells.
    pub fn new(connector: impl Connector + 'static, control: Control, device: impl Any) -> Self {
        Self {
            connector: Box::new(connector),
            account: Box::new(move || (control.line_use(), control.snapshot().frames_resent)),
            device: Box::new(device),
        }
    }
}

impl Attached {
    /// The driver before the device, and what is dropped when that is no longer needed.
    ///
    /// # Errors
    /// When the driver cannot start.
    pub fn driven(self, link: LinkSettings) -> Result<(LinkScanner, Box<dyn Any>)> {
        let connector = Watched::new(self.connector, Arc::default());
        let scanner = LinkScanner::start(connector, link).context("cannot start the driver")?;
        Ok((scanner, self.device))
    }
}

/// A device that sends this, on a pseudo-terminal.
///
/// # Errors
/// When no pseudo-terminal is to be had.
pub fn pseudo_terminal(source: Source, device: DeviceSettings) -> Result<Attached> {
    let config = SimConfig {
        device,
        ..SimConfig::default()
    };
    let server = config.serve_with(source, None)?;
    let settings = SerialSettings::new(server.port().display().to_string());
    let connector = SerialConnector::new(&settings);
    Ok(Attached::new(connector, server.control(), server))
}

/// The fastest of so many scans of a case, whose source is given, over the way to the device that
/// `attach` gives; `way` is its name. What else a machine has to do only makes them slower.
///
/// # Errors
/// When a scan fails, or brings other samples than those that were sent, or has a frame sent
/// again: the line is sound.
pub fn fastest_of(
    scans: u32,
    way: &str,
    (case, source): (&Case, &Source),
    link: &LinkSettings,
    attach: fn(Source, DeviceSettings) -> Result<Attached>,
) -> Result<Row> {
    let mut fastest: Option<Row> = None;
    for _ in 0..scans {
        let row = measure(way, case, link.clone(), || {
            attach(source.clone(), case.device())
        })?;
        ensure!(row.frames_resent == 0, "{way}: a sound line loses frames");
        if fastest.as_ref().is_none_or(|best| row.took < best.took) {
            fastest = Some(row);
        }
    }
    fastest.context("no scan was asked for")
}

fn measure(
    way: &str,
    case: &Case,
    link: LinkSettings,
    attach: impl FnOnce() -> Result<Attached>,
) -> Result<Row> {
    let attached = attach()?;
    let host = Arc::new(HostUse::default());
    let connector = Watched::new(attached.connector, Arc::clone(&host));
    let scanner = LinkScanner::start(connector, link).context("cannot start the driver")?;
    let row = scan(way, case, &scanner, &*attached.account, &host).with_context(|| way.to_owned());
    // The driver says farewell to a device that is still there.
    drop(scanner);
    drop(attached.device);
    row
}

fn scan(
    way: &str,
    case: &Case,
    scanner: &LinkScanner,
    account: &dyn Fn() -> (LineUse, u64),
    host: &HostUse,
) -> Result<Row> {
    let begun = Instant::now();
    let identity = loop {
        match scanner.identify() {
            Ok(identity) => break identity,
            Err(error) if begun.elapsed() > LIMIT => return Err(error).context("it does not come"),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    scanner.home().context("homing")?;
    let mut stream = scanner.start_scan(&identity.limits.proposed)?;
    let acknowledger = stream.acknowledger();
    let mut samples = 0;
    let mut columns = 0;
    // From the first column on: what comes before is the table's way.
    let mut start = None;
    while let Some(column) = stream.next()? {
        acknowledger.acknowledge(column.index);
        match start {
            None => start = Some((Instant::now(), account(), host.read_bytes(), host.waited())),
            Some(_) => {
                samples += column.samples.len();
                columns += 1;
            }
        }
    }
    let (start, (before, resent_before), bytes_before, host_before) = start.context("no column")?;
    let took = start.elapsed();
    let (after, resent) = account();
    let host_waited = host.waited() - host_before;
    let expected = (case.columns as usize - 1, case.samples as usize);
    ensure!(
        (columns, samples) == (expected.0, expected.0 * expected.1),
        "{samples} samples in {columns} columns came, not {} in {}",
        expected.0 * expected.1,
        expected.0
    );
    Ok(Row {
        way: way.to_owned(),
        case: case.clone(),
        took,
        columns,
        samples,
        bytes: host.read_bytes() - bytes_before,
        device_waited: after.waited_for_host - before.waited_for_host,
        without_credit: after.waited_for_credit - before.waited_for_credit,
        host_waited,
        frames_resent: resent - resent_before,
    })
}
