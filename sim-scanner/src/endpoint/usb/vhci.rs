//! Plugging the device into this machine: the kernel's virtual host controller takes one end
//! of a pair of sockets and speaks USB/IP over it.

use std::fs;
use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;

use thiserror::Error;

use super::wire::{BUS_AND_DEVICE, SPEED_HIGH};

const CONTROLLER: &str = "/sys/devices/platform/vhci_hcd.0";

/// Why this machine does not take the device.
#[derive(Debug, Error)]
pub enum VhciError {
    /// The kernel's module is not there.
    #[error("this machine has no virtual USB host controller: load it with `modprobe vhci-hcd`")]
    NoController,
    /// All of its ports are taken.
    #[error(
        "all ports of the virtual USB host controller are taken: detach one with `usbip detach`"
    )]
    NoPort,
    /// The kernel refuses.
    #[error(
        "the virtual USB host controller refuses the device: {0}; it takes devices of root only"
    )]
    Refused(#[source] io::Error),
}

/// Plugs a device in; the result is its end of the cable, and dropping it pulls the plug.
pub(super) fn attach() -> Result<OwnedFd, VhciError> {
    let controller = Path::new(CONTROLLER);
    let status =
        fs::read_to_string(controller.join("status")).map_err(|_| VhciError::NoController)?;
    let port = free_port(&status).ok_or(VhciError::NoPort)?;
    let (ours, kernels) = UnixStream::pair().map_err(VhciError::Refused)?;
    ours.set_nonblocking(true).map_err(VhciError::Refused)?;
    let request = format!(
        "{port} {} {BUS_AND_DEVICE} {SPEED_HIGH}",
        kernels.as_raw_fd()
    );
    fs::write(controller.join("attach"), request).map_err(VhciError::Refused)?;
    Ok(ours.into())
}

/// The first free port for high-speed devices in the kernel's list.
fn free_port(status: &str) -> Option<u32> {
    const FREE: &str = "004";
    status.lines().find_map(|line| {
        let mut fields = line.split_whitespace();
        let (hub, port, state) = (fields.next()?, fields.next()?, fields.next()?);
        (hub == "hs" && state == FREE)
            .then(|| port.parse().ok())
            .flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_free_high_speed_port_is_taken() {
        let list = "hub port sta spd dev      sockfd local_busid\n\
                    hs  0000 006 003 00010001 000003 1-1\n\
                    hs  0001 004 000 00000000 000000 0-0\n\
                    hs  0002 004 000 00000000 000000 0-0\n\
                    ss  0008 004 000 00000000 000000 0-0\n";
        assert_eq!(free_port(list), Some(1));
        assert_eq!(free_port(&list.replace("hs  000", "ss  000")), None);
        assert_eq!(free_port(""), None);
    }
}
