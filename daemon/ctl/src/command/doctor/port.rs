//! The scanner's port.

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

use rustix::fs::{Access, access};

use super::finding::Finding;

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
                file.gid(),
                file.mode() & 0o777
            ),
            "add the service's user to the port's group (often dialout): \
             usermod --append --groups dialout relief, then start the service anew",
        )];
    }
    let holder = scanner_driver::transport::serial::port_holder(&shown.to_string());
    vec![match holder {
        Some(holder) if holder.contains("reliefd") => {
            Finding::good(CHECK, format!("{shown} is in the hands of {holder}"))
        }
        Some(holder) => Finding::bad(
            CHECK,
            format!("{shown} is in use by {holder}"),
            "end that program, or keep it from the port; two programs cannot share it",
        ),
        None => Finding::good(CHECK, format!("{shown} is there, permitted and free")),
    }]
}

fn present_ports() -> String {
    let ports = scanner_driver::transport::serial::list_ports().unwrap_or_default();
    if ports.is_empty() {
        return "no serial port is there at all: plug in and switch on the scanner, and look at \
                the kernel's messages with dmesg"
            .into();
    }
    let names: Vec<String> = ports
        .into_iter()
        .map(|port| match port.usb.and_then(|usb| usb.product) {
            Some(product) => format!("{} ({product})", port.path),
            None => port.path,
        })
        .collect();
    format!(
        "set scanner.port to one that is there: {}",
        names.join(", ")
    )
}
