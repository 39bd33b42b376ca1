//! The sections `[scanner]` and `[scanners.NAME]`: how a scanner is attached.

use std::path::{Path, PathBuf};
use std::time::Duration;

use relief_api::PlanRequest;
use scanner_driver::{LinkSettings, ResumeSettings, SerialSettings, UsbSettings};
use scanner_protocol::usb;
use serde::Deserialize;

use super::value;
use crate::calibration::{CalibrationFile, InForce, USUAL_DAYS};

/// How a scanner is attached, and what it measures.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    default,
    expecting = "a section with the keys of a scanner, such as [scanners.left]"
)]
pub struct ScannerConfig {
    /// Its name, in `[scanner]` alone; the name of the section elsewhere.
    #[serde(deserialize_with = "value::scanner_name")]
    pub name: Option<String>,
    /// Kind of link.
    pub transport: Transport,
    /// Device file of the serial port.
    pub port: PathBuf,
    /// Bits per second of the serial port.
    #[serde(deserialize_with = "value::baud")]
    pub baud: u32,
    /// Vendor number on USB.
    pub vendor_id: u16,
    /// Product number on USB.
    pub product_id: u16,
    /// Serial number: on USB that of the device, without one the only scanner of those numbers;
    /// on a serial port what the scanner itself has to say, without one any.
    #[serde(deserialize_with = "value::serial_number")]
    pub serial_number: Option<String>,
    /// How long a reply to one request may take.
    #[serde(deserialize_with = "value::milliseconds")]
    pub request_timeout_ms: Option<u32>,
    /// How often a request is sent before the scanner counts as silent.
    #[serde(deserialize_with = "value::attempts")]
    pub request_attempts: Option<u32>,
    /// How long the table may take to find its zero.
    #[serde(deserialize_with = "value::milliseconds")]
    pub motion_timeout_ms: Option<u32>,
    /// How long the scanner may take for a column.
    #[serde(deserialize_with = "value::milliseconds")]
    pub column_timeout_ms: Option<u32>,
    /// Silence of the service after which the scanner itself turns its laser off.
    #[serde(deserialize_with = "value::milliseconds")]
    pub dead_man_ms: Option<u32>,
    /// Columns the scanner may send ahead of their acknowledgement.
    #[serde(deserialize_with = "value::credits")]
    pub credits: Option<u32>,
    /// Whether a scan goes on after an interruption; otherwise the first trouble ends it.
    pub resume: bool,
    /// Longest pause, in seconds, after which a scan may go on without a person's word.
    #[serde(deserialize_with = "value::seconds")]
    pub resume_unattended_s: Option<u32>,
    /// File that says how the mounted scanner deviates, from the folder of the configuration.
    pub calibration: Option<PathBuf>,
    /// Days after which that counts as old.
    #[serde(deserialize_with = "value::days")]
    pub calibration_days: Option<u32>,
    /// What the file says.
    #[serde(skip)]
    pub in_force: Option<Box<InForce>>,
    /// What a scan measures on this scanner; what is left out is as in `[scan]`.
    pub scan: PlanRequest,
}

/// Kind of link to the scanner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transport {
    /// A serial port, or what looks like one.
    Serial,
    /// A scanner's own interface on USB.
    Usb,
}

impl Default for ScannerConfig {
    fn default() -> Self {
        Self {
            name: None,
            transport: Transport::Serial,
            port: "/dev/ttyUSB0".into(),
            baud: 921_600,
            vendor_id: usb::VENDOR_ID,
            product_id: usb::PRODUCT_ID_VENDOR,
            serial_number: None,
            request_timeout_ms: None,
            request_attempts: None,
            motion_timeout_ms: None,
            column_timeout_ms: None,
            dead_man_ms: None,
            credits: None,
            resume: true,
            resume_unattended_s: None,
            calibration: None,
            calibration_days: None,
            in_force: None,
            scan: PlanRequest::default(),
        }
    }
}

impl ScannerConfig {
    /// Where the scanner is, for people.
    #[must_use]
    pub fn place(&self) -> String {
        match self.transport {
            Transport::Serial => self.port.display().to_string(),
            Transport::Usb => format!("USB {}", self.usb().place()),
        }
    }

    /// Reads the calibration that is named; `config` is the configuration's own file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn read_calibration(&mut self, config: &Path) -> Result<(), String> {
        let Some(path) = &self.calibration else {
            return match self.calibration_days {
                Some(_) => Err("calibration_days does nothing without `calibration`".into()),
                None => Ok(()),
            };
        };
        let path = config.parent().unwrap_or(Path::new("")).join(path);
        let file = CalibrationFile::read(&path).map_err(|error| format!("calibration: {error}"))?;
        self.in_force = Some(Box::new(InForce {
            file,
            calibration_days: self.calibration_days.unwrap_or(USUAL_DAYS),
        }));
        Ok(())
    }

    /// What the driver of serial ports is told.
    #[must_use]
    pub fn serial(&self) -> SerialSettings {
        let mut settings = SerialSettings::new(self.port.display().to_string());
        settings.baud_rate = self.baud;
        settings.link = self.link();
        settings
    }

    /// What the driver of USB devices is told.
    #[must_use]
    pub fn usb(&self) -> UsbSettings {
        UsbSettings {
            vendor_id: self.vendor_id,
            product_id: self.product_id,
            serial: self.serial_number.clone(),
            link: self.link(),
        }
    }

    /// Longer than the driver may take for anything before it gives up.
    pub(crate) fn longest_wait(&self) -> Duration {
        const RESERVE: Duration = Duration::from_secs(60);
        let link = self.link();
        2 * (link.motion_timeout + link.column_timeout + link.silence) + RESERVE
    }

    fn link(&self) -> LinkSettings {
        let mut link = LinkSettings::default();
        let ms = |ms: Option<u32>, default: Duration| {
            ms.map_or(default, |ms| Duration::from_millis(ms.into()))
        };
        link.request_timeout = ms(self.request_timeout_ms, link.request_timeout);
        link.request_attempts = self.request_attempts.unwrap_or(link.request_attempts);
        link.motion_timeout = ms(self.motion_timeout_ms, link.motion_timeout);
        link.column_timeout = ms(self.column_timeout_ms, link.column_timeout);
        link.dead_man = ms(self.dead_man_ms, link.dead_man);
        // What follows from these, unless the user likes to count: several heartbeats fit into
        // the dead-man time, and silence is longer than all attempts at one request.
        link.heartbeat_interval = link.heartbeat_interval.min(link.dead_man / 4);
        link.silence = link
            .silence
            .max(link.request_timeout * link.request_attempts * 2);
        if let Some(credits) = self.credits {
            link.credits = u16::try_from(credits).unwrap_or(u16::MAX);
        }
        link.resume = self.resume.then(|| {
            let mut resume = ResumeSettings::default();
            if let Some(seconds) = self.resume_unattended_s {
                resume.unattended = Duration::from_secs(seconds.into());
            }
            resume
        });
        link
    }
}
