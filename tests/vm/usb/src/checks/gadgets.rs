//! Both drivers against devices that the kernel makes: the serial port is its own, the
//! vendor's interface is described by us and served by its FunctionFS. What speaks behind
//! them is the simulator, on a pseudo-terminal.

use std::fs::{File, OpenOptions};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use scanner_driver::{Scanner, ScannerError, UsbScanner};
use scanner_protocol::usb::{PRODUCT_ID_CDC_ACM, PRODUCT_ID_VENDOR};
use sim_scanner::endpoint::pty::PtyServer;

use super::{Check, serial, wait_for_path};
use crate::gadget::{Gadget, function_in_user_space, pump};
use crate::scan::{config, scan_is_cut, scan_is_exact, usb};

pub(crate) const CHECKS: [Check; 3] = [
    (
        "gadget: a scan through the kernel's serial port",
        serial_port,
    ),
    (
        "gadget: a scan through the kernel's bulk endpoints, then pulled",
        bulk,
    ),
    (
        "gadget: another device of the same numbers is refused",
        another_device,
    ),
];

fn simulator() -> Result<PtyServer> {
    Ok(config().serve_pty(None)?)
}

fn open_raw(path: &Path) -> Result<File> {
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .open(path)
        .with_context(|| format!("cannot open {}", path.display()))?;
    let mut modes = tcgetattr(&file)?;
    modes.make_raw();
    tcsetattr(&file, OptionalActions::Now, &modes)?;
    Ok(file)
}

fn serial_port() -> Result<()> {
    const OTHER_END: &str = "/dev/ttyGS0";
    wait_for_path(serial::PORT, false)?;
    let server = simulator()?;
    let gadget = Gadget::new("serial", PRODUCT_ID_CDC_ACM, "SIM-0001", "acm.0")?;
    wait_for_path(OTHER_END, true)?;
    let device = open_raw(server.port())?;
    let other_end = open_raw(Path::new(OTHER_END))?;
    pump(device.try_clone()?, other_end.try_clone()?, 512);
    pump(other_end, device, 512);
    gadget.plug_in()?;
    wait_for_path(serial::PORT, true)?;
    let scanner = serial::open()?;
    scan_is_exact(&scanner)?;
    drop(scanner);
    gadget.unplug()?;
    wait_for_path(serial::PORT, false)
}

fn bulk() -> Result<()> {
    /// Not a multiple of the packet, so that every piece ends with a short one.
    const PIECE_TO_HOST: usize = 511;
    /// One packet: a read ends with it.
    const PIECE_FROM_HOST: usize = 512;
    let server = simulator()?;
    let gadget = Gadget::new("bulk", PRODUCT_ID_VENDOR, "SIM-0001", "ffs.scanner")?;
    let endpoints = function_in_user_space("scanner")?;
    let device = open_raw(server.port())?;
    gadget.plug_in()?;
    pump(device.try_clone()?, endpoints.to_host, PIECE_TO_HOST);
    pump(endpoints.from_host, device, PIECE_FROM_HOST);
    let scanner = UsbScanner::open(usb())?;
    scan_is_exact(&scanner)?;
    scan_is_cut(&scanner, || gadget.unplug())?;
    drop(endpoints.control);
    Ok(())
}

fn another_device() -> Result<()> {
    let gadget = Gadget::new("other", PRODUCT_ID_VENDOR, "SIM-0001", "Loopback.0")?;
    gadget.plug_in()?;
    let scanner = UsbScanner::open(usb())?;
    let start = std::time::Instant::now();
    let error = loop {
        match scanner.identify().err().context("it answers")? {
            // It takes a moment to be there.
            ScannerError::NotOnUsb { .. } if start.elapsed() < crate::scan::LIMIT => {
                std::thread::sleep(std::time::Duration::from_millis(50));
            }
            error => break error,
        }
    };
    ensure!(
        error
            .to_string()
            .contains("is no scanner of ours: it has no interface of class ff/53/01"),
        "{error}"
    );
    Ok(())
}
