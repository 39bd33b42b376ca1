//! A scanner's own USB interface as a transport, and the list of USB devices there are.
//!
//! [`UsbConnector`] finds the device ([`list`]), claims its interface and gives the two bulk
//! endpoints to a transport that keeps several transfers under way each way. What stands in
//! the way is told in words.

mod claim;
mod find;
mod pipe;
mod power;

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::Path;

use scanner_protocol::usb;

pub use find::{UsbDevice, UsbInterface, list};

use super::{Connector, Transport};
use crate::error::ScannerError;
use crate::settings::LinkSettings;

/// Where the kernel lists USB devices.
const DEVICES: &str = "/sys/bus/usb/devices";

/// Which scanner on USB, and how to talk to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbSettings {
    /// Vendor number.
    pub vendor_id: u16,
    /// Product number.
    pub product_id: u16,
    /// Serial number; without one, the only device of these numbers.
    pub serial: Option<String>,
    /// Times and attempts.
    pub link: LinkSettings,
}

impl Default for UsbSettings {
    fn default() -> Self {
        Self {
            vendor_id: usb::VENDOR_ID,
            product_id: usb::PRODUCT_ID_VENDOR,
            serial: None,
            link: LinkSettings::default(),
        }
    }
}

impl UsbSettings {
    /// What is looked for, for messages: `1209:0001, serial SIM-0001`.
    #[must_use]
    pub fn place(&self) -> String {
        let numbers = format!("{:04x}:{:04x}", self.vendor_id, self.product_id);
        match &self.serial {
            Some(serial) => format!("{numbers}, serial {serial}"),
            None => numbers,
        }
    }

    /// Whether this device is looked for.
    #[must_use]
    pub fn fits(&self, device: &UsbDevice) -> bool {
        device.vendor_id == self.vendor_id
            && device.product_id == self.product_id
            && self
                .serial
                .as_ref()
                .is_none_or(|serial| device.serial.as_ref() == Some(serial))
    }
}

/// Opens one scanner on USB.
#[derive(Debug)]
pub struct UsbConnector {
    settings: UsbSettings,
    /// The names of all devices at the last attempt.
    seen: BTreeSet<OsString>,
}

impl UsbConnector {
    /// For the scanner of these settings.
    #[must_use]
    pub fn new(settings: &UsbSettings) -> Self {
        Self {
            settings: settings.clone(),
            seen: BTreeSet::new(),
        }
    }
}

impl Connector for UsbConnector {
    fn name(&self) -> String {
        format!("USB {}", self.settings.place())
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        // Before the look, so that what comes during it is seen as new.
        self.seen = present();
        let device = find::one(&self.settings)?;
        let pipes = claim::claim(&device)?;
        Ok(Box::new(pipe::UsbTransport::new(pipes)))
    }

    fn appeared(&mut self) -> bool {
        let present = present();
        let more = present.iter().any(|name| !self.seen.contains(name));
        self.seen = present;
        more
    }
}

/// Names of the devices and interfaces that the kernel has now; none without USB.
///
/// One look into a folder, which needs neither udev nor a right that containers lack.
fn present() -> BTreeSet<OsString> {
    std::fs::read_dir(Path::new(DEVICES))
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name())
        .collect()
}
