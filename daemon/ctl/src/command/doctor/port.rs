//! The scanner's port.

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

use rustix::fs::{Access, access};
use scanner_driver::transport::serial::{self, PortInfo};

use super::finding::Finding;
use super::free;

const CHECK: &str = "scanner port";

/// Whether the port is there, permitted, and free for the service.
pub(super) fn check(port: &Path) -> Vec<Finding> {
    let shown = port.display();
    let Ok(file) = fs::metadata(port) else {
        return vec![Finding::bad(
            CHECK,
            format!("there is no {shown}"),
            present_ports(),
        )];
    };
    if !file.file_type().is_char_device() {
        return vec![Finding::bad(
            CHECK,
            format!("{shown} is not a serial port"),
            "set scanner.port to the scanner's device, best a path below /dev/serial/by-id",
        )];
    }
    if access(port, Access::READ_OK | Access::WRITE_OK).is_err() {
        return vec![Finding::bad(
            CHECK,
            format!(
                "{shown} may not be used by this user (group {}, mode {:o})",
                serial::port_group(&shown.to_string()),
                file.mode() & 0o777
            ),
            format!(
                "add the service's user to the port's group: usermod --append --groups {} relief, \
                 then start the service anew",
                serial::port_group(&shown.to_string())
            ),
        )];
    }
    let holder = serial::port_holder(&shown.to_string());
    vec![match holder {
        Some(holder) if holder.contains("reliefd") => {
            Finding::good(CHECK, format!("{shown} is in the hands of {holder}"))
        }
        Some(holder) => Finding::bad(
            CHECK,
            format!("{shown} is in use by {holder}"),
            "end that program, or keep it from the port; two programs cannot share it",
        ),
        None => Finding::good(CHECK, format!("{shown} is there, permitted and {}", free())),
    }]
}

/// All serial ports, for those who look for the right one.
pub(super) fn present() -> Finding {
    const CHECK: &str = "serial ports";
    match serial::list_ports() {
        Ok(ports) if ports.is_empty() => Finding::good(CHECK, "none"),
        Ok(ports) => {
            let all: Vec<String> = ports.iter().map(describe).collect();
            Finding::good(CHECK, all.join("; "))
        }
        Err(error) => Finding::doubtful(
            CHECK,
            error.to_string(),
            "look for them with ls -l /dev/serial/by-id",
        ),
    }
}

/// Vendor and product number of the USB device behind a port, if there is one.
pub(super) fn usb_numbers(port: &Path) -> Option<(u16, u16)> {
    // Ports are listed by their own names, and configured by links to them.
    let own = fs::canonicalize(port).ok()?;
    let ports = serial::list_ports().unwrap_or_default();
    let usb = ports
        .into_iter()
        .find(|listed| Path::new(&listed.path) == own)?
        .usb?;
    Some((usb.vendor_id, usb.product_id))
}

fn describe(port: &PortInfo) -> String {
    let mut text = port.path.clone();
    if let Some(usb) = &port.usb {
        text.push_str(&format!(" ({:04x}:{:04x}", usb.vendor_id, usb.product_id));
        if let Some(product) = &usb.product {
            text.push_str(&format!(" {product}"));
        }
        if let Some(serial) = &usb.serial {
            text.push_str(&format!(", serial {serial}"));
        }
        text.push(')');
    }
    if let Some(holder) = serial::port_holder(&port.path) {
        text.push_str(&format!(", used by {holder}"));
    }
    text
}

fn present_ports() -> String {
    let ports = serial::list_ports().unwrap_or_default();
    if ports.is_empty() {
        return "no serial port is there at all: plug in and switch on the scanner, and look at \
                the kernel's messages with dmesg; a scanner with a USB interface of its own needs \
                scanner.transport = \"usb\""
            .into();
    }
    let names: Vec<String> = ports.iter().map(describe).collect();
    format!(
        "set scanner.port to one that is there: {}",
        names.join("; ")
    )
}

#[cfg(test)]
mod tests {
    use scanner_driver::transport::serial::UsbInfo;

    use super::*;

    #[test]
    fn a_port_is_told_with_the_device_behind_it() {
        let port = PortInfo {
            path: "/dev/relief-no-such-port".into(),
            usb: Some(UsbInfo {
                vendor_id: 0x1209,
                product_id: 2,
                manufacturer: None,
                product: Some("Scanner".into()),
                serial: Some("7".into()),
            }),
        };
        assert_eq!(
            describe(&port),
            "/dev/relief-no-such-port (1209:0002 Scanner, serial 7)"
        );
        assert_eq!(usb_numbers(Path::new("/dev/null")), None);
    }
}
