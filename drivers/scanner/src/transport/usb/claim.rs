//! From a device to its two bulk endpoints.

use nusb::descriptors::TransferType;
use nusb::transfer::{Bulk, Direction, In, Out};
use nusb::{Endpoint, ErrorKind, Interface, MaybeFuture};
use scanner_protocol::usb::INTERFACE;

use super::find::{self, UsbDevice};
use super::power;
use crate::error::ScannerError;

/// The endpoints of a claimed interface, which is released when both are dropped.
pub(super) struct Pipes {
    pub(super) incoming: Endpoint<Bulk, In>,
    pub(super) outgoing: Endpoint<Bulk, Out>,
}

/// Opens the device and claims its scanner interface.
pub(super) fn claim(device: &UsbDevice) -> Result<Pipes, ScannerError> {
    let Some(wanted) = device.scanner_interface() else {
        return Err(not_ours(device));
    };
    let open = device
        .info
        .open()
        .wait()
        .map_err(|error| refused(device, &error))?;
    power::keep_awake(&device.sysfs);
    let interface = match open.claim_interface(wanted.number).wait() {
        Ok(interface) => interface,
        Err(error) if error.kind() == ErrorKind::Busy => {
            // Ours must be closed, not to be taken for the holder.
            drop(open);
            return Err(ScannerError::UsbBusy {
                device: device.to_string(),
                holder: busy_with(device, wanted.number),
            });
        }
        Err(error) => return Err(refused(device, &error)),
    };
    let mut pipes = pipes(device, &interface)?;
    // What an earlier program left halted flows again, and both sides agree on the toggle.
    for cleared in [
        pipes.incoming.clear_halt().wait(),
        pipes.outgoing.clear_halt().wait(),
    ] {
        cleared.map_err(|error| refused(device, &error))?;
    }
    Ok(pipes)
}

fn pipes(device: &UsbDevice, interface: &Interface) -> Result<Pipes, ScannerError> {
    let address = |direction: Direction| {
        interface.descriptor()?.endpoints().find_map(|endpoint| {
            (endpoint.transfer_type() == TransferType::Bulk && endpoint.direction() == direction)
                .then(|| endpoint.address())
        })
    };
    let (Some(incoming), Some(outgoing)) = (address(Direction::In), address(Direction::Out)) else {
        return Err(ScannerError::NotAScannerOnUsb {
            device: device.to_string(),
            why: format!("its interface {INTERFACE} lacks a bulk endpoint in each direction"),
        });
    };
    Ok(Pipes {
        incoming: interface
            .endpoint(incoming)
            .map_err(|error| refused(device, &error))?,
        outgoing: interface
            .endpoint(outgoing)
            .map_err(|error| refused(device, &error))?,
    })
}

fn not_ours(device: &UsbDevice) -> ScannerError {
    // So it is while a device comes and goes, or when the kernel may not set it up.
    if device.interfaces.is_empty() {
        return ScannerError::NotOnUsb {
            wanted: device.to_string(),
            present: "the device, but not set up by the kernel (if that lasts, dmesg tells why)"
                .to_owned(),
        };
    }
    let classes: Vec<String> = device
        .interfaces
        .iter()
        .map(|interface| interface.class.to_string())
        .collect();
    ScannerError::NotAScannerOnUsb {
        device: device.to_string(),
        why: format!(
            "it has no interface of class {INTERFACE}, but {}",
            classes.join(", ")
        ),
    }
}

fn busy_with(device: &UsbDevice, interface: u8) -> Option<String> {
    match find::driver(&device.sysfs, interface) {
        // The kernel's word for "a program".
        Some(driver) if driver != "usbfs" => Some(format!("the kernel's driver {driver}")),
        _ => device.holder(),
    }
}

/// What a refusal by the operating system means for the user.
fn refused(device: &UsbDevice, error: &nusb::Error) -> ScannerError {
    match error.kind() {
        ErrorKind::PermissionDenied => ScannerError::UsbPermission {
            device: device.to_string(),
            node: device.node.display().to_string(),
            group: device.group(),
        },
        // Its file is made a moment after it is listed, and goes with the plug.
        ErrorKind::Disconnected | ErrorKind::NotFound => ScannerError::NotOnUsb {
            wanted: device.to_string(),
            present: "the device, plugged in or out at this moment".to_owned(),
        },
        ErrorKind::Busy => ScannerError::UsbBusy {
            device: device.to_string(),
            holder: device.holder(),
        },
        _ => ScannerError::Port {
            port: format!("USB {device}"),
            message: error.to_string(),
        },
    }
}
