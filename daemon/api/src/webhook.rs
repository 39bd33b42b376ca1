//! Webhooks: who is told of what, and what became of it.

use serde::{Deserialize, Serialize};

use crate::job::Job;
use crate::laser::LaserState;
use crate::scan::Scan;
use crate::status::{ScannerLink, ScannerStatus};

/// How a receiver of messages is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WebhookKind {
    /// Messages are posted to a URL, signed.
    #[default]
    Webhook,
    /// Messages are published to a broker, by MQTT.
    Mqtt,
    /// People are written to.
    Mail,
    /// A program is run, with what the message says in its environment.
    Hook,
    /// The result that the message tells of is copied elsewhere.
    Upload,
    /// Of a kind that this version does not know; never sent.
    #[serde(other)]
    Unknown,
}

impl WebhookKind {
    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Webhook => "webhook",
            Self::Mqtt => "mqtt",
            Self::Mail => "mail",
            Self::Hook => "hook",
            Self::Upload => "upload",
            Self::Unknown => "unknown",
        }
    }
}

/// What a webhook can be told of.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    utoipa::ToSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum WebhookEvent {
    /// A scan is over: complete, aborted, failed or interrupted.
    ScanEnded,
    /// A scan stands still and waits for a person.
    ScanPaused,
    /// A job is done: its result is in the spool.
    JobDone,
    /// A job has failed.
    JobFailed,
    /// A scanner got into trouble: an open interlock, a fault of the laser, a lost line.
    ScannerTrouble,
    /// An interlock was opened, or the emergency stop pressed; `scanner-trouble` tells of it, too.
    Interlock,
    /// Little room is left on the disk.
    DiskLow,
    /// Somebody has asked for a test; every webhook is told.
    Test,
    /// Of a kind that this version does not know; never sent.
    #[serde(other)]
    Unknown,
}

impl WebhookEvent {
    /// Those that a webhook can be set to.
    pub const CHOICES: [Self; 7] = [
        Self::ScanEnded,
        Self::ScanPaused,
        Self::JobDone,
        Self::JobFailed,
        Self::ScannerTrouble,
        Self::Interlock,
        Self::DiskLow,
    ];

    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::ScanEnded => "scan-ended",
            Self::ScanPaused => "scan-paused",
            Self::JobDone => "job-done",
            Self::JobFailed => "job-failed",
            Self::ScannerTrouble => "scanner-trouble",
            Self::Interlock => "interlock",
            Self::DiskLow => "disk-low",
            Self::Test => "test",
            Self::Unknown => "unknown",
        }
    }
}

/// What is posted to a webhook.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WebhookMessage {
    /// What happened.
    #[serde(rename = "type")]
    pub event: WebhookEvent,
    /// When it happened, RFC 3339 in UTC: when the scan or job ended, when the pause or the
    /// trouble was noted.
    pub timestamp: String,
    /// What it is about.
    pub data: WebhookData,
}

/// What a message is about; each event has its own part of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WebhookData {
    /// Name of the scanner, of all but `disk-low` and `test`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scanner: Option<String>,
    /// The scan, as it was then; of a job the scan that it processes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<Scan>,
    /// The job, as it was then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub job: Option<Job>,
    /// How the scanner does, of `scanner-trouble` and `interlock`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<ScannerStatus>,
    /// The disk, of `disk-low`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disk: Option<DiskRoom>,
    /// Name of the receiver, of `test`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub webhook: Option<String>,
}

/// What is left of a disk.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DiskRoom {
    /// The folder on it: that of the kept scans, or of the results.
    pub folder: String,
    /// Bytes free there.
    pub free_bytes: u64,
    /// With fewer, this is told (`storage.low_mb`).
    pub low_bytes: u64,
    /// Bytes that are to stay free; a scan that would need them is refused.
    pub reserve_bytes: u64,
}

/// How a scanner is, as brokers keep it (`PREFIX/scanners/NAME/state`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScannerState {
    /// Its name.
    pub name: String,
    /// How the service stands with it.
    pub link: ScannerLink,
    /// Its laser; absent until the scanner was first asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<LaserState>,
    /// What is wrong, when something is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// Id of the scan under way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<String>,
    /// Its columns on disk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Its columns in all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns_planned: Option<u32>,
}

/// A webhook, as it is configured and as it does. Its secret is never told.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Webhook {
    /// Its name.
    pub name: String,
    /// What it is; services that told only webhooks left it out.
    #[serde(default)]
    pub kind: WebhookKind,
    /// Where messages go: of a webhook scheme, host and port, and `/...` for a path or query, which
    /// may be secret; of a broker its address and what every topic begins with; of mail the
    /// server.
    pub url: String,
    /// What it is told of.
    pub events: Vec<WebhookEvent>,
    /// Messages that wait to be delivered.
    pub waiting: usize,
    /// Messages that had to make room for newer ones since the service started.
    #[serde(default)]
    pub dropped: u64,
    /// The message that was last tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latest: Option<Delivery>,
}

/// The webhooks.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WebhookList {
    /// In the order of the configuration.
    pub webhooks: Vec<Webhook>,
}

/// Where a message stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeliveryState {
    /// Has not been taken yet, and is tried again.
    Waiting,
    /// The receiver has taken it.
    Delivered,
    /// It is not tried any more.
    GivenUp,
    /// It had to make room for newer ones before it was taken.
    Dropped,
}

impl DeliveryState {
    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Delivered => "delivered",
            Self::GivenUp => "given_up",
            Self::Dropped => "dropped",
        }
    }
}

/// A message to a webhook, and what became of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Delivery {
    /// Its id, `webhook-id` of every attempt: whoever has got it twice sees it by that. It follows
    /// from what it tells of, and when that happened.
    pub id: String,
    /// What it tells of.
    pub event: WebhookEvent,
    /// The scan or scanner it is about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Where it stands.
    pub state: DeliveryState,
    /// When it was made, RFC 3339 in UTC: later than what it tells of where the disk was in the
    /// way.
    pub created_at: String,
    /// How often it was tried.
    pub attempts: u32,
    /// The latest attempts, oldest first.
    pub tried: Vec<DeliveryAttempt>,
    /// When it is tried next, unless the service starts anew before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_attempt_at: Option<String>,
}

/// An attempt to deliver a message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DeliveryAttempt {
    /// When it began, RFC 3339 in UTC.
    pub at: String,
    /// How long it took.
    pub milliseconds: u64,
    /// Status of the receiver's answer, if there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<u16>,
    /// What went wrong, and what to do about it; nothing if it was taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The beginning of what the receiver said to its refusal, with `...` for the path and query
    /// of its url; nothing of a redirection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<String>,
}

/// The log of a webhook: all messages that wait, and the latest of the others.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DeliveryList {
    /// Newest first.
    pub deliveries: Vec<Delivery>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_spelt_as_in_json() {
        for event in WebhookEvent::CHOICES
            .into_iter()
            .chain([WebhookEvent::Test])
        {
            let text = serde_json::to_string(&event).unwrap();
            assert_eq!(text, format!("{:?}", event.as_str()));
        }
        let later: WebhookEvent = serde_json::from_str("\"tea-ready\"").unwrap();
        assert_eq!(later, WebhookEvent::Unknown);
    }
}
