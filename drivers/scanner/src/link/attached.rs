//! Scanners by the way they are attached: a link, and where it leads.

use scanner_protocol::{Identity, ScanPlan};

use super::LinkScanner;
use crate::error::ScannerError;
use crate::recovery::InterruptedScan;
use crate::scanner::{DeviceStatus, ScanStream, Scanner};
use crate::transport::serial::{SerialConnector, SerialSettings};
use crate::transport::usb::{UsbConnector, UsbSettings};

macro_rules! attached {
    ($(#[$doc:meta])* $name:ident, $connector:ident, $settings:ident) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name {
            link: LinkScanner,
        }

        impl $name {
            /// Starts to talk to the scanner, which may appear later.
            ///
            /// # Errors
            /// As [`LinkScanner::start`]; why the scanner cannot be reached shows with the
            /// first call.
            pub fn open(settings: $settings) -> Result<Self, ScannerError> {
                let connector = $connector::new(&settings);
                LinkScanner::start(connector, settings.link).map(|link| Self { link })
            }

            /// The link, for what only this kind of scanner can do.
            #[must_use]
            pub fn link(&self) -> &LinkScanner {
                &self.link
            }
        }

        impl Scanner for $name {
            fn identify(&self) -> Result<Identity, ScannerError> {
                self.link.identify()
            }

            fn home(&self) -> Result<(), ScannerError> {
                self.link.home()
            }

            fn status(&self) -> Result<DeviceStatus, ScannerError> {
                self.link.status()
            }

            fn start_scan(&self, plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
                self.link.start_scan(plan)
            }

            fn take_up_scan(&self, scan: InterruptedScan) -> Result<ScanStream, ScannerError> {
                self.link.take_up_scan(scan)
            }

            fn resume_scan(&self) -> Result<(), ScannerError> {
                self.link.resume_scan()
            }

            fn pause_scan(&self) -> Result<(), ScannerError> {
                self.link.pause_scan()
            }

            fn abort(&self) -> Result<(), ScannerError> {
                self.link.abort()
            }
        }
    };
}

attached! {
    /// A scanner on a serial line.
    SerialScanner, SerialConnector, SerialSettings
}

attached! {
    /// A scanner with an interface of its own on USB.
    UsbScanner, UsbConnector, UsbSettings
}
