//! The simulator's program on the network, attached by the Linux tools for USB/IP, which know
//! nothing of us.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};
use rustix::process::{Pid, Signal, kill_process};
use scanner_driver::{Scanner, ScannerError, UsbScanner};

use super::Check;
use crate::scan::{COLUMNS, SAMPLES, scan_is_cut, scan_is_exact, usb};

pub(crate) const CHECKS: [Check; 1] = [(
    "network: listed, attached, scanned, pulled, attached again",
    attached_by_others,
)];

struct Program(Child);

impl Program {
    fn start() -> Result<Self> {
        let mut child = Command::new("/bin/sim-scanner")
            .args(["--usbip", "127.0.0.1:3240"])
            .args(["--columns", &COLUMNS.to_string()])
            .args(["--samples", &SAMPLES.to_string()])
            .stdout(Stdio::piped())
            .spawn()
            .context("no sim-scanner")?;
        let said = child.stdout.take().context("piped")?;
        for line in BufReader::new(said).lines() {
            if line?.starts_with("serving") {
                return Ok(Self(child));
            }
        }
        anyhow::bail!("it ended before it served")
    }

    fn signal(&self, signal: Signal) -> Result<()> {
        Ok(kill_process(Pid::from_child(&self.0), signal)?)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn usbip(arguments: &[&str]) -> Result<String> {
    let output = Command::new("/usr/sbin/usbip")
        .args(arguments)
        .output()
        .context("no usbip")?;
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    ensure!(output.status.success(), "usbip {arguments:?}: {said}");
    Ok(said)
}

fn attach() -> Result<()> {
    usbip(&["attach", "-r", "127.0.0.1", "-b", "1-1"]).map(|_| ())
}

fn attached_by_others() -> Result<()> {
    let program = Program::start()?;
    let list = usbip(&["list", "-r", "127.0.0.1"])?;
    ensure!(
        list.contains("(1209:0001)") && list.contains("1-1:"),
        "{list}"
    );
    attach()?;
    let scanner = UsbScanner::open(usb())?;
    scan_is_exact(&scanner)?;
    let refused = attach().err().context("it was attached twice")?;
    ensure!(refused.to_string().contains("busy"), "{refused:#}");
    scan_is_cut(&scanner, || program.signal(Signal::USR1))?;
    let error = scanner.identify().err().context("it answers")?;
    ensure!(matches!(error, ScannerError::NotOnUsb { .. }), "{error}");
    program.signal(Signal::USR2)?;
    // The program takes the signal when it comes to it.
    let start = std::time::Instant::now();
    while let Err(error) = attach() {
        ensure!(start.elapsed() < crate::scan::LIMIT, "{error:#}");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    scan_is_exact(&scanner)
}
