//! How fast each way to the device is. The figures are of an emulated machine: only their
//! relation says something about another.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::PoisonError;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use scanner_driver::{
    LinkScanner, LinkSettings, Scanner, SerialScanner, SerialSettings, UsbScanner,
};
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::control::LineUse;
use sim_scanner::endpoint::usb::{Attachment, Personality};

use crate::checks::{serial, wait_for_path};
use crate::memory::MemoryConnector;
use crate::scan::{link, plan, usb, wait_for};

const COLUMNS: u32 = 300;
const SAMPLES: u32 = 200;
const RECORDING: &str = "/tmp/recording.xyz";

pub(crate) fn table() -> Result<()> {
    record(Path::new(RECORDING))?;
    let config = SimConfig {
        object: Object::Recording(RECORDING.into()),
        ..SimConfig::default()
    };
    let source = config.source()?;
    println!("        way to the device        MB/s   waiting for the host");

    let (connector, line) = MemoryConnector::new(source.clone(), config.device.clone(), 1);
    let scanner = LinkScanner::start(connector, fast())?;
    let line = || *line.lock().unwrap_or_else(PoisonError::into_inner);
    measure("memory", &scanner, line)?;

    let server = config.serve_with(source.clone(), None)?;
    let control = server.control();
    let port = server.port().display().to_string();
    measure("pseudo-terminal", &open_port(port)?, || control.line_use())?;

    let here = Attachment::ThisMachine;
    let server = config.serve_usb(source.clone(), Personality::Vendor, here)?;
    let control = server.control();
    let mut settings = usb();
    settings.link = fast();
    measure(
        "USB, vendor's interface",
        &UsbScanner::open(settings)?,
        || control.line_use(),
    )?;
    drop(server);

    wait_for_path(serial::PORT, false)?;
    let server = config.serve_usb(source, Personality::CdcAcm, here)?;
    let control = server.control();
    let scanner = open_port(serial::PORT.into())?;
    measure("USB, serial port", &scanner, || control.line_use())
}

fn open_port(path: String) -> Result<SerialScanner> {
    let mut settings = SerialSettings::new(path);
    settings.link = fast();
    Ok(SerialScanner::open(settings)?)
}

/// As many columns in flight as the simulator keeps.
fn fast() -> LinkSettings {
    LinkSettings {
        credits: 64,
        ..link()
    }
}

/// A bent sheet: a recording takes no time to measure.
fn record(path: &Path) -> Result<()> {
    let mut file = std::io::BufWriter::new(fs::File::create(path)?);
    for column in 0..COLUMNS {
        for sample in 0..SAMPLES {
            let (x, y) = (f64::from(column) * 0.5, f64::from(sample) * 0.5);
            writeln!(file, "{x} {y} {}", x * y * 0.001)?;
        }
    }
    Ok(file.flush()?)
}

fn measure(way: &str, scanner: &dyn Scanner, line: impl Fn() -> LineUse) -> Result<()> {
    wait_for(scanner)?;
    scanner.home().context("homing")?;
    let mut stream = scanner.start_scan(&plan(scanner)?).context("start")?;
    let acknowledger = stream.acknowledger();
    // From the first column on: what comes before is the table's way.
    let mut begin = None;
    let mut samples = 0;
    while let Some(column) = stream.next().with_context(|| way.to_owned())? {
        acknowledger.acknowledge(column.index);
        samples += column.samples.len();
        begin.get_or_insert_with(|| (std::time::Instant::now(), line()));
    }
    let after = line();
    let (start, before) = begin.context("no column")?;
    ensure!(
        samples == (COLUMNS * SAMPLES) as usize,
        "{way}: {samples} samples"
    );
    let elapsed = start.elapsed();
    let bytes = after.to_host_bytes - before.to_host_bytes;
    let waited: Duration = after.waited_for_host - before.waited_for_host;
    println!(
        "        {way:<24} {:>5.2}   {:>3.0} %",
        bytes as f64 / elapsed.as_secs_f64() / 1e6,
        100.0 * waited.as_secs_f64() / elapsed.as_secs_f64()
    );
    Ok(())
}
