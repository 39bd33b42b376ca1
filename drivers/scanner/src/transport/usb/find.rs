//! Which USB devices there are, and the one that is meant.

use std::path::{Path, PathBuf};

use nusb::{DeviceInfo, MaybeFuture};
use scanner_protocol::usb::{INTERFACE, InterfaceClass};

use super::{DEVICES, UsbSettings};
use crate::error::ScannerError;
use crate::transport::holder::{group_of, holder};

/// A USB device of this machine.
#[derive(Debug, Clone)]
pub struct UsbDevice {
    /// Vendor number.
    pub vendor_id: u16,
    /// Product number.
    pub product_id: u16,
    /// Name of the maker.
    pub manufacturer: Option<String>,
    /// Name of the product.
    pub product: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
    /// Its interfaces.
    pub interfaces: Vec<UsbInterface>,
    /// The device file by which programs use it.
    pub node: PathBuf,
    /// Its folder in `/sys`.
    pub sysfs: PathBuf,
    pub(super) info: DeviceInfo,
}

/// An interface of a USB device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbInterface {
    /// Its number.
    pub number: u8,
    /// What sort it is of.
    pub class: InterfaceClass,
    /// The kernel driver that has it; `usbfs` stands for a program.
    pub driver: Option<String>,
}

impl UsbDevice {
    /// The interface that speaks our protocol.
    #[must_use]
    pub fn scanner_interface(&self) -> Option<&UsbInterface> {
        self.interfaces
            .iter()
            .find(|interface| interface.class == INTERFACE)
    }

    /// Name and process id of a program that has the device open, as far as this user may
    /// see.
    #[must_use]
    pub fn holder(&self) -> Option<String> {
        holder(&self.node)
    }

    /// The group that may use the device.
    #[must_use]
    pub fn group(&self) -> String {
        group_of(&self.node)
    }

    /// Whether the kernel may put the device to sleep when nothing goes on.
    #[must_use]
    pub fn may_sleep(&self) -> bool {
        super::power::may_sleep(&self.sysfs)
    }

    fn new(info: DeviceInfo) -> Self {
        let sysfs = info.sysfs_path().to_owned();
        Self {
            vendor_id: info.vendor_id(),
            product_id: info.product_id(),
            manufacturer: info.manufacturer_string().map(str::to_owned),
            product: info.product_string().map(str::to_owned),
            serial: info.serial_number().map(str::to_owned),
            interfaces: info
                .interfaces()
                .map(|interface| UsbInterface {
                    number: interface.interface_number(),
                    class: InterfaceClass {
                        class: interface.class(),
                        subclass: interface.subclass(),
                        protocol: interface.protocol(),
                    },
                    driver: driver(&sysfs, interface.interface_number()),
                })
                .collect(),
            node: format!(
                "/dev/bus/usb/{:03}/{:03}",
                info.busnum(),
                info.device_address()
            )
            .into(),
            sysfs,
            info,
        }
    }
}

impl std::fmt::Display for UsbDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:04x}:{:04x}", self.vendor_id, self.product_id)?;
        if let Some(product) = &self.product {
            write!(f, " {product}")?;
        }
        match &self.serial {
            Some(serial) => write!(f, ", serial {serial}"),
            None => Ok(()),
        }
    }
}

/// The kernel driver of an interface now.
pub(super) fn driver(sysfs: &Path, interface: u8) -> Option<String> {
    // The folder is named as the device, with the configuration's number in between.
    let ending = format!(".{interface}");
    let folder = std::fs::read_dir(sysfs).ok()?.flatten().find(|entry| {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        name.contains(':') && name.ends_with(&ending)
    })?;
    let driver = std::fs::read_link(folder.path().join("driver")).ok()?;
    Some(driver.file_name()?.to_string_lossy().into_owned())
}

/// The USB devices of this machine, hubs aside, in the order of their device files.
///
/// # Errors
/// [`ScannerError::Port`] if the list cannot be had.
pub fn list() -> Result<Vec<UsbDevice>, ScannerError> {
    const HUB: u8 = 9;
    if !Path::new(DEVICES).is_dir() {
        return Ok(Vec::new());
    }
    let found = nusb::list_devices()
        .wait()
        .map_err(|error| ScannerError::Port {
            port: "list of USB devices".to_owned(),
            message: error.to_string(),
        })?;
    let mut devices: Vec<UsbDevice> = found
        .filter(|info| info.class() != HUB)
        .map(UsbDevice::new)
        .collect();
    devices.sort_by(|a, b| a.node.cmp(&b.node));
    Ok(devices)
}

/// The one device that the settings mean.
pub(super) fn one(settings: &UsbSettings) -> Result<UsbDevice, ScannerError> {
    choose(settings, list()?)
}

fn choose(settings: &UsbSettings, devices: Vec<UsbDevice>) -> Result<UsbDevice, ScannerError> {
    let (mut fitting, others): (Vec<_>, Vec<_>) = devices
        .into_iter()
        .partition(|device| settings.fits(device));
    match (fitting.pop(), fitting.len()) {
        (Some(device), 0) => Ok(device),
        (Some(last), _) => Err(ScannerError::ManyOnUsb {
            wanted: settings.place(),
            serials: fitting
                .iter()
                .chain([&last])
                .map(|device| device.serial.as_deref().unwrap_or("(none)"))
                .collect::<Vec<_>>()
                .join(", "),
        }),
        (None, _) => Err(ScannerError::NotOnUsb {
            wanted: settings.place(),
            present: present_text(&others),
        }),
    }
}

/// What is there instead: scanners first, and nothing that would fill a screen.
fn present_text(devices: &[UsbDevice]) -> String {
    const SHOWN: usize = 8;
    if devices.is_empty() {
        return "no USB device at all".to_owned();
    }
    let (scanners, others): (Vec<_>, Vec<_>) = devices
        .iter()
        .partition(|device| device.scanner_interface().is_some());
    let names: Vec<String> = scanners
        .iter()
        .map(|device| format!("scanner {device}"))
        .chain(others.iter().map(ToString::to_string))
        .collect();
    let mut text = names
        .iter()
        .take(SHOWN)
        .map(String::as_str)
        .collect::<Vec<_>>()
        .join("; ");
    if names.len() > SHOWN {
        text.push_str(&format!("; and {} more", names.len() - SHOWN));
    }
    text
}
