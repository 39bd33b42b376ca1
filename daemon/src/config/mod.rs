//! The configuration file: its sections, defaults and checks.
//!
//! A key that does not exist, or a value that cannot be, is refused with its line and a
//! way out; nothing is silently ignored.

mod http;
mod load;
mod processing;
mod reload;
mod storage;
mod value;

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use relief_api::PlanRequest;
use scanner_driver::{LinkSettings, ResumeSettings, SerialSettings, UsbSettings};
use scanner_protocol::usb;
use serde::{Deserialize, Serialize};

pub use http::HttpConfig;
pub use load::ConfigError;
pub use processing::{
    DeliverablesConfig, Estimator, Method, OverrideError, Processing, ReconstructConfig,
    RegridConfig, SegmentConfig,
};
pub use reload::Reloaded;
pub use storage::{Limits, StorageConfig};

/// The whole configuration.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Where the service is found and keeps its things.
    pub service: ServiceConfig,
    /// What clients may ask of the API at most.
    pub http: HttpConfig,
    /// How the scanner is attached.
    pub scanner: ScannerConfig,
    /// What a scan measures unless it is asked for something else.
    pub scan: PlanRequest,
    /// How scans are kept on disk.
    pub journal: JournalConfig,
    /// Room on the disk.
    pub storage: StorageConfig,
    /// From samples to the uniform range image.
    pub regrid: RegridConfig,
    /// From the range image to regions.
    pub segment: SegmentConfig,
    /// From regions to trimmed surfaces.
    pub reconstruct: ReconstructConfig,
    /// What is left in the spool.
    pub deliverables: DeliverablesConfig,
    /// How jobs are run.
    pub queue: QueueConfig,
    /// What is logged.
    pub log: LogConfig,
}

/// Where the service is found and keeps its things.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServiceConfig {
    /// Unix socket of the HTTP API.
    pub socket: PathBuf,
    /// Group whose users may use the socket; that of the service unless set.
    #[serde(deserialize_with = "value::group")]
    pub socket_group: Option<String>,
    /// Permissions of the socket's file, in octal: never for everybody.
    #[serde(deserialize_with = "value::socket_mode")]
    pub socket_mode: u32,
    /// Loopback address on which the API is offered to bearers of a token; none unless set.
    #[serde(deserialize_with = "value::loopback")]
    pub listen: Option<SocketAddr>,
    /// Folder of the kept scans and of the job queue.
    pub state_dir: PathBuf,
    /// Folder in which results appear.
    pub spool_dir: PathBuf,
}

impl Default for ServiceConfig {
    fn default() -> Self {
        Self {
            socket: "/run/relief/reliefd.sock".into(),
            socket_group: None,
            socket_mode: 0o660,
            listen: None,
            state_dir: "/var/lib/relief".into(),
            spool_dir: "/var/spool/relief".into(),
        }
    }
}

/// How the scanner is attached.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScannerConfig {
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
    /// Serial number on USB; without one, the only scanner of those numbers.
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

/// How scans are kept on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JournalConfig {
    /// Columns are synced to disk, and acknowledged to the scanner, at the latest when
    /// this many wait ...
    #[serde(deserialize_with = "value::sync_columns")]
    pub sync_columns: u32,
    /// ... or the first of them has waited this long.
    #[serde(deserialize_with = "value::sync_ms")]
    pub sync_ms: u32,
}

impl JournalConfig {
    /// How long a column may wait for its sync.
    #[must_use]
    pub fn interval(&self) -> Duration {
        Duration::from_millis(self.sync_ms.into())
    }
}

impl Default for JournalConfig {
    fn default() -> Self {
        Self {
            sync_columns: 8,
            sync_ms: 20,
        }
    }
}

/// How jobs are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QueueConfig {
    /// Jobs processed at the same time.
    #[serde(deserialize_with = "value::workers")]
    pub workers: usize,
    /// Threads each of them may use; 0 for as many as the machine has cores.
    #[serde(deserialize_with = "value::threads")]
    pub threads: usize,
}

impl Default for QueueConfig {
    fn default() -> Self {
        Self {
            workers: 1,
            threads: 0,
        }
    }
}

/// What is logged.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogConfig {
    /// Least level, or a filter such as `info,reliefd=debug`.
    #[serde(deserialize_with = "value::log_filter")]
    pub level: String,
    /// Where to and how.
    pub format: LogFormat,
}

/// Where the log goes and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// `journald` when started by systemd, else `text`.
    #[default]
    Auto,
    /// Lines for people, on standard error.
    Text,
    /// The systemd journal, with fields.
    Journald,
    /// One JSON object a line, on standard error.
    Json,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self {
            level: "info".into(),
            format: LogFormat::Auto,
        }
    }
}

impl Config {
    /// The part of the configuration that decides what a job makes of a scan.
    #[must_use]
    pub fn processing(&self) -> Processing {
        Processing {
            regrid: self.regrid.clone(),
            segment: self.segment.clone(),
            reconstruct: self.reconstruct.clone(),
            deliverables: self.deliverables.clone(),
        }
    }
}

fn is_loopback(address: &SocketAddr) -> bool {
    match address.ip() {
        IpAddr::V4(ip) => ip.is_loopback(),
        IpAddr::V6(ip) => ip.is_loopback(),
    }
}
