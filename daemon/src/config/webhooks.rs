//! The sections `[[webhooks]]`: who is told when something is done.

use std::path::PathBuf;
use std::time::Duration;

use relief_api::WebhookEvent;
use serde::Deserialize;

use super::receivers::{KeyFault, Retry, check_ca_file, default_events, default_timeout_ms};
use super::value;

/// A webhook: who is told of what.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WebhookConfig {
    /// Its name; safe in a path and on a command line.
    #[serde(deserialize_with = "value::webhook_name")]
    pub name: String,
    /// Where messages are posted to.
    #[serde(deserialize_with = "value::webhook_url")]
    pub url: String,
    /// File with the secret by which messages are signed.
    pub secret_file: PathBuf,
    /// What it is told of.
    #[serde(default = "default_events", deserialize_with = "value::webhook_events")]
    pub events: Vec<WebhookEvent>,
    /// How long an attempt may take, with all that belongs to it.
    #[serde(
        default = "default_timeout_ms",
        deserialize_with = "value::webhook_milliseconds"
    )]
    pub timeout_ms: u32,
    /// File with the certificates of the authorities that are trusted; without it, those that
    /// the machine trusts.
    #[serde(default)]
    pub ca_file: Option<PathBuf>,
    /// When a message is tried again; no key of the file.
    #[serde(skip)]
    pub retry: Retry,
}

impl WebhookConfig {
    /// A webhook with everything else as it is by default.
    #[must_use]
    pub fn new(name: &str, url: &str, secret_file: impl Into<PathBuf>) -> Self {
        Self {
            name: name.to_owned(),
            url: url.to_owned(),
            secret_file: secret_file.into(),
            events: default_events(),
            timeout_ms: default_timeout_ms(),
            ca_file: None,
            retry: Retry::default(),
        }
    }

    /// How long an attempt may take.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms.into())
    }

    pub(super) fn check(&self) -> Result<(), KeyFault> {
        let is_secure = self.url.starts_with("https:");
        check_ca_file(self.ca_file.as_deref(), is_secure, "https")
    }
}
