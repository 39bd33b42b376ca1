//! The seam between the driver and the bytes' way to the device.
//!
//! [`serial`] is a serial port, [`usb`] a scanner's own interface on USB, [`memory`] a pair
//! of pipes for tests.

pub mod memory;
pub mod serial;
pub mod usb;

mod holder;

use std::io;
use std::time::Duration;

use crate::error::ScannerError;

/// A way for bytes to and from one device.
pub trait Transport: Send {
    /// Reads what is there, waiting up to `timeout` for the first byte. `Ok(0)` means that
    /// nothing came in that time.
    ///
    /// # Errors
    /// Any error means that the device is gone.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// Writes as much as the line takes within `timeout`, and says how much that was.
    ///
    /// # Errors
    /// Any error means that the device is gone.
    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize>;
}

/// Opens transports to one place, again and again.
pub trait Connector: Send {
    /// The place's name, for messages.
    fn name(&self) -> String;

    /// Opens a transport.
    ///
    /// # Errors
    /// Why it cannot be opened now. It will be tried again later.
    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError>;

    /// Whether the device may have come since this or [`Connector::connect`] was last called,
    /// so that there is no need to wait for the next attempt. Asked several times a second
    /// while there is no connection.
    fn appeared(&mut self) -> bool {
        false
    }
}

impl<F> Connector for (String, F)
where
    F: FnMut() -> Result<Box<dyn Transport>, ScannerError> + Send,
{
    fn name(&self) -> String {
        self.0.clone()
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        self.1()
    }
}
