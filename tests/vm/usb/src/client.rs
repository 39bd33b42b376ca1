//! What this program does as another process: it tries to use the scanner, and says what came
//! of it.

use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};
use scanner_driver::{Scanner, SerialScanner, SerialSettings, UsbScanner, UsbSettings};

/// Uses the scanner at a place (a port, or a serial number on USB), as this user.
pub(crate) fn run(role: &str, place: Option<&str>) -> ExitCode {
    let identity = match role {
        "usb" => {
            let settings = UsbSettings {
                serial: place.map(str::to_owned),
                ..UsbSettings::default()
            };
            UsbScanner::open(settings).and_then(|scanner| scanner.identify())
        }
        _ => SerialScanner::open(SerialSettings::new(place.unwrap_or_default()))
            .and_then(|scanner| scanner.identify()),
    };
    match identity {
        Ok(identity) => println!("it answers: {}", identity.serial.as_str()),
        Err(error) => println!("{error}"),
    }
    ExitCode::SUCCESS
}

/// What another process of this user (0 for root) says when it tries to use the scanner.
pub(crate) fn said_by_another(role: &str, place: &str, user: u32) -> Result<String> {
    let output = Command::new("/proc/self/exe")
        .args([role, place])
        .uid(user)
        .gid(user)
        .output()
        .context("cannot start another process")?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
