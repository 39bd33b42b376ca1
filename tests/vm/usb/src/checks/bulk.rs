//! The driver of the vendor's interface, against the simulator plugged into this machine.

use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use scanner_driver::{
    ResumeSettings, ScanProgress, Scanner, ScannerError, UsbScanner, UsbSettings,
};
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};

use super::Check;
use crate::boot::load;
use crate::client::said_by_another;
use crate::scan::{self, LIMIT, config, listed, scan_is_cut, scan_is_exact, usb, wait_for};

pub(crate) const CHECKS: [Check; 10] = [
    ("bulk: a scan is that in memory", whole),
    (
        "bulk: a second program is told who has the device",
        second_claim,
    ),
    (
        "bulk: a kernel driver that has the device is named",
        kernel_driver,
    ),
    (
        "bulk: a user without the right is told of it",
        no_permission,
    ),
    (
        "bulk: a wrong serial number is told with what is there",
        wrong_serial,
    ),
    (
        "bulk: two of a kind are told apart by serial number",
        two_of_a_kind,
    ),
    ("bulk: pulled in mid-scan, put back, scanned again", unplug),
    (
        "bulk: pulled in every tenth column, the scan goes on",
        pulled_again_and_again,
    ),
    ("bulk: a halted endpoint is set going again", halt),
    ("bulk: the device is kept awake", awake),
];

fn serve() -> Result<UsbServer> {
    let config = config();
    let source = config.source()?;
    Ok(config.serve_usb(source, Personality::Vendor, Attachment::ThisMachine)?)
}

fn open() -> Result<UsbScanner> {
    Ok(UsbScanner::open(usb())?)
}

fn serial() -> String {
    config().device.serial
}

fn whole() -> Result<()> {
    let _server = serve()?;
    let scanner = open()?;
    scan_is_exact(&scanner)?;
    let device = listed()?;
    ensure!(device.serial.as_deref() == Some(&serial()), "{device}");
    drop(scanner);
    // What the last one left, the next finds in order.
    scan_is_exact(&open()?)
}

fn second_claim() -> Result<()> {
    let _server = serve()?;
    let scanner = open()?;
    wait_for(&scanner)?;
    let own = fs::read_to_string("/proc/self/comm")?;
    let said = said_by_another("usb", &serial(), 0)?;
    ensure!(
        said.ends_with(&format!("is in use by {} (process 1)", own.trim())),
        "{said}"
    );
    // The first has not been disturbed.
    scan_is_exact(&scanner)
}

/// The kernel's driver of serial adapters takes whatever it is told to.
fn kernel_driver() -> Result<()> {
    const MODULE: &str = "/spare/usbserial.ko";
    load(Path::new(MODULE), c"vendor=0x1209 product=0x0001")?;
    let _server = serve()?;
    let start = std::time::Instant::now();
    loop {
        let interface = listed()?.scanner_interface().cloned();
        if interface.is_some_and(|interface| interface.driver.is_some()) {
            break;
        }
        ensure!(start.elapsed() < LIMIT, "the driver does not take it");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let scanner = open()?;
    let error = scanner.identify().err().context("it answers")?;
    // Whatever comes of this, the checks that follow must have the device.
    rustix::system::delete_module(c"usbserial", 0)?;
    ensure!(
        error
            .to_string()
            .ends_with("is in use by the kernel's driver usbserial_generic"),
        "{error}"
    );
    scan_is_exact(&scanner)
}

fn no_permission() -> Result<()> {
    const NOBODY: u32 = 65_534;
    let _server = serve()?;
    let node = listed()?.node;
    let said = said_by_another("usb", &serial(), NOBODY)?;
    let (node, group) = (node.display(), "the group `root`; install the udev rules");
    ensure!(
        said.starts_with("no permission") && said.contains(&format!("{node} belongs to {group}")),
        "{said}"
    );
    Ok(())
}

fn wrong_serial() -> Result<()> {
    let _server = serve()?;
    listed()?;
    let other = UsbScanner::open(UsbSettings {
        serial: Some("NONE".into()),
        ..usb()
    })?;
    let error = other.identify().err().context("it answers")?;
    let there = format!(
        "There is: scanner 1209:0001 SimScanner, serial {}",
        serial()
    );
    ensure!(
        matches!(error, ScannerError::NotOnUsb { .. }) && error.to_string().contains(&there),
        "{error}"
    );
    Ok(())
}

fn two_of_a_kind() -> Result<()> {
    let _first = serve()?;
    listed()?;
    let mut second = config();
    second.device.serial = "SIM-0002".into();
    let source = second.source()?;
    let _second = second.serve_usb(source, Personality::Vendor, Attachment::ThisMachine)?;
    let named = UsbScanner::open(UsbSettings {
        serial: Some("SIM-0002".into()),
        ..usb()
    })?;
    wait_for(&named)?;
    ensure!(named.identify()?.serial.as_str() == "SIM-0002");
    let any = UsbScanner::open(UsbSettings {
        serial: None,
        ..usb()
    })?;
    let error = any.identify().err().context("it answers")?.to_string();
    ensure!(error.contains("SIM-0001, SIM-0002"), "{error}");
    Ok(())
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
        let device = control.snapshot();
        ensure!(!device.laser_on, "the laser stays on without a host");
        ensure!(device.homed, "the table's position was forgotten");
        let error = scanner.identify().err().context("it answers")?;
        ensure!(matches!(error, ScannerError::NotOnUsb { .. }), "{error}");
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

/// The scan goes on after each, and nothing is lost or taken twice.
fn pulled_again_and_again() -> Result<()> {
    const EVERY: usize = 10;
    let server = serve()?;
    let control = server.control();
    let mut settings = usb();
    settings.link.resume = Some(ResumeSettings::default());
    // Few columns in flight, so that each pull cuts the scan and not what is here already.
    settings.link.credits = 4;
    let scanner = UsbScanner::open(settings)?;
    wait_for(&scanner)?;
    scanner.home()?;
    let start = Instant::now();
    let mut stream = scanner.start_scan(&scan::plan(&scanner)?)?;
    let acknowledger = stream.acknowledger();
    let mut columns = Vec::new();
    let mut pauses = 0;
    loop {
        match stream.next_progress()? {
            Some(ScanProgress::Column(column)) => {
                // Without credit for the rest, the scan cannot end before the plug is out.
                if columns.len() % EVERY == EVERY - 1 && columns.len() + 1 < scan::COLUMNS as usize
                {
                    control.unplug();
                    control.wait_for_host(LIMIT, false)?;
                    ensure!(!control.snapshot().laser_on, "the laser stays on");
                    control.replug();
                }
                acknowledger.acknowledge(column.index);
                columns.push(column);
            }
            Some(ScanProgress::Paused(pause)) => {
                ensure!(!pause.needs_person, "{pause}");
                pauses += 1;
            }
            Some(ScanProgress::Resumed) => {}
            None => break,
        }
    }
    let took = start.elapsed().as_secs_f64();
    ensure!(columns == scan::reference()?, "the columns differ");
    let pulls = (scan::COLUMNS as usize - 1) / EVERY;
    ensure!(pauses >= pulls, "{pauses} pauses after {pulls} pulls");
    let bytes: usize = columns.iter().map(|column| column.samples.len() * 6).sum();
    println!(
        "        {pauses} pauses; goodput {:.1} kB/s over {took:.1} s",
        bytes as f64 / took / 1e3
    );
    Ok(())
}

fn halt() -> Result<()> {
    let server = serve()?;
    let control = server.control();
    let scanner = open()?;
    wait_for(&scanner)?;
    scanner.home()?;
    let mut stream = scanner.start_scan(&scan::plan(&scanner)?)?;
    let acknowledger = stream.acknowledger();
    let mut columns = Vec::new();
    while let Some(column) = stream.next()? {
        if columns.len() % 12 == 5 {
            control.halt_endpoint();
        }
        acknowledger.acknowledge(column.index);
        columns.push(column);
    }
    ensure!(columns == scan::reference()?, "the columns differ");
    Ok(())
}

fn awake() -> Result<()> {
    let _server = serve()?;
    let control = listed()?.sysfs.join("power/control");
    fs::write(&control, "auto")?;
    ensure!(listed()?.may_sleep());
    let scanner = open()?;
    wait_for(&scanner)?;
    ensure!(!listed()?.may_sleep(), "{}", fs::read_to_string(&control)?);
    Ok(())
}
