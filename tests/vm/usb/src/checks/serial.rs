//! The driver of serial ports, against the simulator as a CDC-ACM device.

use anyhow::{Context, Result, ensure};
use scanner_driver::transport::serial::list_ports;
use scanner_driver::{Scanner, ScannerError, SerialScanner, SerialSettings};
use scanner_protocol::usb::{PRODUCT_ID_CDC_ACM, VENDOR_ID};
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};

use super::{Check, wait_for_path};
use crate::client::said_by_another;
use crate::scan::{LIMIT, config, link, scan_is_cut, scan_is_exact, wait_for};

pub(crate) const PORT: &str = "/dev/ttyACM0";

pub(crate) const CHECKS: [Check; 3] = [
    ("serial: a scan is that in memory", whole),
    (
        "serial: a second program is told who has the port",
        second_open,
    ),
    (
        "serial: pulled in mid-scan, put back, scanned again",
        unplug,
    ),
];

fn serve() -> Result<UsbServer> {
    // Whatever the check before left must be gone, or this becomes another port.
    wait_for_path(PORT, false)?;
    let config = config();
    let source = config.source()?;
    Ok(config.serve_usb(source, Personality::CdcAcm, Attachment::ThisMachine)?)
}

pub(crate) fn open() -> Result<SerialScanner> {
    let mut settings = SerialSettings::new(PORT);
    settings.link = link();
    Ok(SerialScanner::open(settings)?)
}

fn whole() -> Result<()> {
    let _server = serve()?;
    let scanner = open()?;
    scan_is_exact(&scanner)?;
    let ports = list_ports()?;
    let port = ports.iter().find(|port| port.path == PORT);
    let usb = port
        .and_then(|port| port.usb.as_ref())
        .context("not listed")?;
    ensure!((usb.vendor_id, usb.product_id) == (VENDOR_ID, PRODUCT_ID_CDC_ACM));
    ensure!(usb.serial == Some(config().device.serial), "{usb:?}");
    drop(scanner);
    scan_is_exact(&open()?)
}

fn second_open() -> Result<()> {
    let _server = serve()?;
    let scanner = open()?;
    wait_for(&scanner)?;
    let said = said_by_another("serial", PORT, 0)?;
    ensure!(
        said.starts_with(&format!("the port {PORT} is in use by "))
            && said.ends_with("(process 1)"),
        "{said}"
    );
    scan_is_exact(&scanner)
}

fn unplug() -> Result<()> {
    let server = serve()?;
    let control = server.control();
    let scanner = open()?;
    for _ in 0..2 {
        scan_is_cut(&scanner, || {
            control.unplug();
            Ok(control.wait_for_host(LIMIT, false)?)
        })?;
        ensure!(
            !control.snapshot().laser_on,
            "the laser stays on without a host"
        );
        wait_for_path(PORT, false)?;
        let error = scanner.identify().err().context("it answers")?;
        ensure!(matches!(error, ScannerError::NoSuchPort { .. }), "{error}");
        control.replug();
        let took = wait_for(&scanner)?;
        println!(
            "        back {:.2} s after it was plugged in",
            took.as_secs_f64()
        );
        scan_is_exact(&scanner)?;
    }
    Ok(())
}
