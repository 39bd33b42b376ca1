//! The driver of the slide-table scanner: session, retries, column stream, transports.
//!
//! [`Scanner`] is what the rest of the program sees. [`SerialScanner`] is a scanner on a
//! serial line, [`UsbScanner`] one with a USB interface of its own: a thread owns it, and [`session::Session`] decides what
//! goes over it; the session knows neither ports nor clocks. [`LinkScanner`] does the same
//! over any [`transport::Transport`].

pub mod limits;
pub mod recovery;
pub mod session;
pub mod transport;

mod error;
mod link;
mod scanner;
mod settings;

pub use error::ScannerError;
pub use link::{LinkScanner, SerialScanner, UsbScanner};
pub use recovery::{ColumnSource, InterruptedScan, Pause};
pub use scanner::{
    Acknowledger, DeviceStatus, LineCounts, RawColumn, RawSample, ScanInfo, ScanProgress,
    ScanStream, Scanner, StreamControl, StreamItem,
};
pub use settings::{LinkSettings, ResumeSettings};
pub use transport::serial::SerialSettings;
pub use transport::usb::UsbSettings;

pub use scanner_protocol as protocol;
