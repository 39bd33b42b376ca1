//! The configuration file: its sections, defaults and checks.
//!
//! A key that does not exist, or a value that cannot be, is refused with its line and a
//! way out; nothing is silently ignored.

mod discovery;
mod fill;
mod formats;
mod further;
mod hooks;
mod http;
mod load;
mod mail;
mod mqtt;
mod nats;
mod network;
mod overrides;
mod processing;
mod receivers;
mod regularities;
mod reload;
mod roles;
mod scanner;
mod scanners;
mod storage;
mod traces;
mod uploads;
mod value;
mod webhooks;

use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use relief_api::{PlanRequest, THE_SCANNER};
use serde::{Deserialize, Serialize};

pub use discovery::DiscoveryConfig;
pub use fill::{FillConfig, FillMode};
pub use further::{
    KnotsChoice, MachineChoice, OfChoice, PatternChoice, SkinConfig, SkinMethod, SurfaceConfig,
    ToolpathConfig,
};
pub use hooks::{HookConfig, HookEvent, HookSandbox};
pub use http::HttpConfig;
pub use load::ConfigError;
pub use mail::{MailConfig, MailSecurity};
pub use mqtt::MqttConfig;
pub(crate) use mqtt::Place;
pub use nats::NatsConfig;
pub use network::{NetworkChoice, NetworkContent};
pub use overrides::OverrideError;
pub use processing::{
    DeliverablesConfig, Estimator, Kinds, Method, PageChoice, Processing, ReconstructConfig,
    RegridConfig, SegmentConfig, StepChoice, StepUnits,
};
pub use receivers::Retry;
pub use regularities::{Regularize, RegularizeUnits};
pub use reload::Reloaded;
pub use roles::Role;
pub use scanner::{ScannerConfig, Transport};
pub use storage::{Acknowledged, Limits, StorageConfig, Unacknowledged};
pub use traces::TracesConfig;
pub use uploads::{UploadConfig, UploadTo};
pub(crate) use value::is_host_name;
pub use webhooks::WebhookConfig;

/// The whole configuration.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Where the service is found and keeps its things.
    pub service: ServiceConfig,
    /// What clients may ask of the API at most.
    pub http: HttpConfig,
    /// The scanner, where there is one.
    pub scanner: ScannerConfig,
    /// The scanners by name, where there are several; then `scanner` counts for nothing.
    pub scanners: BTreeMap<String, ScannerConfig>,
    /// What a scan measures unless its scanner, or whoever asks for it, says otherwise.
    pub scan: PlanRequest,
    /// How scans are kept on disk.
    pub journal: JournalConfig,
    /// Room on the disk.
    pub storage: StorageConfig,
    /// Whether others on the network are told of the service.
    pub discovery: DiscoveryConfig,
    /// From samples to the uniform range image.
    pub regrid: RegridConfig,
    /// From the range image to regions.
    pub segment: SegmentConfig,
    /// Which holes of the range image are closed.
    pub fill: FillConfig,
    /// From regions to trimmed surfaces.
    pub reconstruct: ReconstructConfig,
    /// What is left in the spool.
    pub deliverables: DeliverablesConfig,
    /// How jobs are run.
    pub queue: QueueConfig,
    /// Whether jobs go to workers elsewhere.
    pub nats: NatsConfig,
    /// Who is told when something is done.
    pub webhooks: Vec<WebhookConfig>,
    /// Brokers that are told, too.
    pub mqtt: Vec<MqttConfig>,
    /// People who are written to.
    pub mail: Vec<MailConfig>,
    /// What is run for each result.
    pub hooks: Vec<HookConfig>,
    /// Where copies of results go.
    pub uploads: Vec<UploadConfig>,
    /// Who is told how long things took.
    pub traces: TracesConfig,
    /// What is logged.
    pub log: LogConfig,
}

/// Where the service is found and keeps its things.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServiceConfig {
    /// What this service is there for: all of it unless set.
    #[serde(deserialize_with = "roles::roles")]
    pub roles: BTreeSet<Role>,
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
    /// Where people find the service's page, through whatever leads there: mails link to it.
    #[serde(deserialize_with = "value::public_url")]
    pub public_url: Option<String>,
    /// Folder of the kept scans and of the job queue.
    pub state_dir: PathBuf,
    /// Folder in which results appear.
    pub spool_dir: PathBuf,
}

impl Default for ServiceConfig {
    fn default() -> Self {
        Self {
            roles: BTreeSet::from(Role::ALL),
            socket: "/run/relief/reliefd.sock".into(),
            socket_group: None,
            socket_mode: 0o660,
            listen: None,
            public_url: None,
            state_dir: "/var/lib/relief".into(),
            spool_dir: "/var/spool/relief".into(),
        }
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
    /// Threads each of them may use; 0 for as many as the machine has cores, but for one for each
    /// scan that is under way when the job begins.
    #[serde(deserialize_with = "value::threads")]
    pub threads: usize,
}

impl QueueConfig {
    /// Threads that a job may use on a machine with so many cores while so many scans are under way.
    pub(crate) fn threads_beside(&self, cores: usize, scans: usize) -> usize {
        match self.threads {
            0 => cores.saturating_sub(scans).max(1),
            configured => configured,
        }
    }
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

/// A scanner as it is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedScanner<'a> {
    /// Its name; safe as a file name and in a path.
    pub name: &'a str,
    /// How it is attached, and what it measures.
    pub config: &'a ScannerConfig,
    /// It is the one of `[scanner]`.
    pub is_the_only: bool,
}

impl NamedScanner<'_> {
    /// Its section of the file.
    #[must_use]
    pub fn section(&self) -> String {
        if self.is_the_only {
            "scanner".to_owned()
        } else {
            format!("scanners.{}", self.name)
        }
    }
}

impl Config {
    /// The scanners in the order of their names; at least one.
    #[must_use]
    pub fn each_scanner(&self) -> Vec<NamedScanner<'_>> {
        if self.scanners.is_empty() {
            return vec![NamedScanner {
                name: self.scanner.name.as_deref().unwrap_or(THE_SCANNER),
                config: &self.scanner,
                is_the_only: true,
            }];
        }
        let named = self.scanners.iter().map(|(name, config)| NamedScanner {
            name,
            config,
            is_the_only: false,
        });
        named.collect()
    }

    /// What a scan on this scanner measures unless it is asked for something else.
    #[must_use]
    pub fn scan_on(&self, scanner: &str) -> PlanRequest {
        let all = self.each_scanner();
        let own = all.iter().find(|one| one.name == scanner);
        own.map_or(self.scan, |own| own.config.scan.or(&self.scan))
    }

    /// The part of the configuration that decides what a job makes of a scan.
    #[must_use]
    pub fn processing(&self) -> Processing {
        Processing {
            regrid: self.regrid.clone(),
            segment: self.segment.clone(),
            fill: self.fill.clone(),
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

#[cfg(test)]
mod tests {
    use super::QueueConfig;

    #[test]
    fn jobs_leave_a_core_to_each_scan_unless_their_threads_are_configured() {
        let by_itself = QueueConfig::default();
        assert_eq!(by_itself.threads_beside(4, 0), 4);
        assert_eq!(by_itself.threads_beside(4, 1), 3);
        assert_eq!(by_itself.threads_beside(2, 3), 1);
        let configured = QueueConfig {
            threads: 6,
            ..by_itself
        };
        assert_eq!(configured.threads_beside(4, 1), 6);
    }
}
