//! A serial port as a transport, and the list of ports there are.

use std::io::{self, Read};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::fs::{FlockOperation, Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{ControlModes, OptionalActions};
use serialport::{ClearBuffer, SerialPort, SerialPortType};

use super::holder::{group_of, holder};
use super::{Connector, Transport};
use crate::error::ScannerError;
use crate::settings::LinkSettings;

/// Where a scanner on a serial line is, and how to talk to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialSettings {
    /// Path of the port, such as `/dev/serial/by-id/...`; a symbolic link will do.
    pub path: String,
    /// Bits per second. Pseudo-terminals and USB serial ports take any.
    pub baud_rate: u32,
    /// Times and attempts.
    pub link: LinkSettings,
}

impl SerialSettings {
    /// The port at this path, at 115,200 baud and with the usual times.
    #[must_use]
    pub fn new(path: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            baud_rate: 115_200,
            link: LinkSettings::default(),
        }
    }
}

/// A port is busy for a moment after it has been closed, where the program that had it, this one
/// perhaps, was just starting another: until that has begun, it holds what was open. So a busy port
/// is tried again a few times before it is told to be.
const BUSY_ATTEMPTS: u32 = 40;
const BUSY_PAUSE: Duration = Duration::from_millis(25);

/// Opens one serial port.
#[derive(Debug)]
pub struct SerialConnector {
    path: String,
    baud_rate: u32,
    /// Whether the path was there at the last look.
    there: bool,
}

impl SerialConnector {
    /// For the port of these settings.
    #[must_use]
    pub fn new(settings: &SerialSettings) -> Self {
        Self {
            path: settings.path.clone(),
            baud_rate: settings.baud_rate,
            there: false,
        }
    }

    /// What a refusal by the operating system means for the user.
    fn refused(&self, errno: Errno) -> ScannerError {
        let port = self.path.clone();
        match errno {
            Errno::NOENT | Errno::NXIO | Errno::NODEV | Errno::IO => {
                ScannerError::NoSuchPort { port }
            }
            Errno::ACCESS => ScannerError::Permission {
                group: group_of(Path::new(&port)),
                port,
            },
            Errno::PERM => ScannerError::Forbidden { port },
            Errno::BUSY | Errno::WOULDBLOCK => self.busy(),
            Errno::ISDIR | Errno::NOTTY | Errno::NOTDIR => ScannerError::NotAPort { port },
            errno => ScannerError::Port {
                port,
                message: errno.to_string(),
            },
        }
    }

    /// Busy, who holds it not being looked for yet: there are attempts to come.
    fn busy(&self) -> ScannerError {
        ScannerError::PortBusy {
            holder: None,
            port: self.path.clone(),
        }
    }

    /// Opens the port for a first look: says exactly what is wrong with it, if anything,
    /// and keeps the modem lines from dropping whenever it is closed, since many boards
    /// take that for a reset.
    fn prepare(&self) -> Result<OwnedFd, Errno> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let port = rustix::fs::open(&self.path, flags, Mode::empty())?;
        if !rustix::termios::isatty(&port) {
            return Err(Errno::NOTTY);
        }
        rustix::fs::flock(&port, FlockOperation::NonBlockingLockExclusive)?;
        let mut modes = rustix::termios::tcgetattr(&port)?;
        modes.control_modes.remove(ControlModes::HUPCL);
        rustix::termios::tcsetattr(&port, OptionalActions::Now, &modes)?;
        rustix::fs::flock(&port, FlockOperation::NonBlockingUnlock)?;
        Ok(port)
    }

    fn open(&self) -> Result<Box<dyn Transport>, ScannerError> {
        let direct = self.prepare().map_err(|errno| self.refused(errno))?;
        let port = serialport::new(&self.path, self.baud_rate)
            .preserve_dtr_on_open()
            .exclusive(true)
            .open()
            .map_err(|error| match error.kind() {
                serialport::ErrorKind::NoDevice => self.busy(),
                _ => ScannerError::Port {
                    port: self.path.clone(),
                    message: error.to_string(),
                },
            })?;
        // What an earlier session left unread is of no use. Failing to drop it does no harm:
        // late frames are told apart by their request ids.
        let _ = port.clear(ClearBuffer::All);
        Ok(Box::new(SerialTransport { port, direct }))
    }
}

impl Connector for SerialConnector {
    fn name(&self) -> String {
        self.path.clone()
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        self.there = Path::new(&self.path).exists();
        for _ in 1..BUSY_ATTEMPTS {
            match self.open() {
                Err(ScannerError::PortBusy { .. }) => std::thread::sleep(BUSY_PAUSE),
                outcome => return outcome,
            }
        }
        self.open().map_err(|error| match error {
            ScannerError::PortBusy { port, .. } => ScannerError::PortBusy {
                holder: holder(Path::new(&port)),
                port,
            },
            other => other,
        })
    }

    fn appeared(&mut self) -> bool {
        let before = std::mem::replace(&mut self.there, Path::new(&self.path).exists());
        self.there && !before
    }
}

struct SerialTransport {
    port: Box<dyn SerialPort>,
    /// The same port, opened so that it never blocks. The library's own writes may wait
    /// without end for a device that does not read, and an abort would wait with them.
    direct: OwnedFd,
}

impl Transport for SerialTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.port.set_timeout(timeout)?;
        match self.port.read(buffer) {
            // Readable and yet empty: the other end has hung up.
            Ok(0) if !buffer.is_empty() => Err(io::ErrorKind::UnexpectedEof.into()),
            // The library tells of a hang-up before what was sent before it has been read.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                match rustix::io::read(&self.direct, buffer) {
                    Ok(count) if count > 0 => Ok(count),
                    _ => Err(error),
                }
            }
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::TimedOut
                        | io::ErrorKind::Interrupted
                        | io::ErrorKind::WouldBlock
                ) =>
            {
                Ok(0)
            }
            result => result,
        }
    }

    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        let timeout = Timespec::try_from(timeout).map_err(io::Error::other)?;
        let mut ready = [PollFd::new(&self.direct, PollFlags::OUT)];
        match rustix::event::poll(&mut ready, Some(&timeout)) {
            Ok(0) | Err(Errno::INTR) => return Ok(0),
            Ok(_) => {}
            Err(errno) => return Err(errno.into()),
        }
        match rustix::io::write(&self.direct, bytes) {
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(errno) => Err(errno.into()),
        }
    }
}

/// A serial port of this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortInfo {
    /// Its path.
    pub path: String,
    /// The USB device behind it, if it is one.
    pub usb: Option<UsbInfo>,
}

/// What a USB device says about itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbInfo {
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
}

/// The serial ports of this machine, in the order of their paths. Pseudo-terminals are not
/// among them.
///
/// # Errors
/// [`ScannerError::Port`] if the list cannot be had.
pub fn list_ports() -> Result<Vec<PortInfo>, ScannerError> {
    // The library panics where there is no such folder, as in some containers.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let ports = serialport::available_ports().map_err(|error| ScannerError::Port {
        port: "list of serial ports".to_owned(),
        message: error.to_string(),
    })?;
    let mut ports: Vec<PortInfo> = ports
        .into_iter()
        .map(|port| PortInfo {
            path: port.port_name,
            usb: match port.port_type {
                SerialPortType::UsbPort(usb) => Some(UsbInfo {
                    vendor_id: usb.vid,
                    product_id: usb.pid,
                    manufacturer: usb.manufacturer,
                    product: usb.product,
                    serial: usb.serial_number,
                }),
                _ => None,
            },
        })
        .collect();
    ports.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(ports)
}

/// Name and process id of the program that has this port open, as far as this user may see.
#[must_use]
pub fn port_holder(path: &str) -> Option<String> {
    holder(Path::new(path))
}

/// The group that may use this port, by name or number.
#[must_use]
pub fn port_group(path: &str) -> String {
    group_of(Path::new(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_may_not_use_a_port_is_told_why() {
        let connector = SerialConnector::new(&SerialSettings::new("/dev/null"));
        let told = |errno| connector.refused(errno).to_string();
        assert!(told(Errno::ACCESS).contains("belongs to the group `root`"));
        // The device policy of a unit, which no group changes.
        let told = told(Errno::PERM);
        assert!(
            told.contains("DeviceAllow=") && !told.contains("group `"),
            "{told}"
        );
    }
}
