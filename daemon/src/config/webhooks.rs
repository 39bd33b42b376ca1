//! The sections `[[webhooks]]`: who is told when something is done.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use relief_api::WebhookEvent;
use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use super::load::line_and_column;
use super::{Config, value};
use crate::receivers::check_files;

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

fn default_events() -> Vec<WebhookEvent> {
    use WebhookEvent as E;
    vec![E::ScanEnded, E::JobDone, E::JobFailed]
}

fn default_timeout_ms() -> u32 {
    10_000
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
}

/// When a message is tried again that was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retry {
    /// After the first attempt; three times as long after each further one ...
    pub first: Duration,
    /// ... up to this.
    pub longest: Duration,
    /// For how long since it was made a message is tried ...
    pub lasting: Duration,
    /// ... and how often at least, whatever the clock was set to meanwhile.
    pub attempts: u32,
}

impl Default for Retry {
    fn default() -> Self {
        Self {
            first: Duration::from_secs(5),
            longest: Duration::from_secs(4 * 3_600),
            lasting: Duration::from_secs(24 * 3_600),
            attempts: 8,
        }
    }
}

/// Each has a thread of its own; more are a mistake.
const MOST_WEBHOOKS: usize = 16;

/// Where something is wrong, in bytes from the beginning of the text, and what.
type Fault = (usize, String);

/// A section of the file.
struct Section<'a>(&'a DeTable<'a>);

impl Section<'_> {
    /// Where the value of a key stands.
    fn value(&self, name: &str) -> usize {
        let found = self.0.iter().find(|(key, _)| key.get_ref() == name);
        found.map_or(0, |(_, value)| value.span().start)
    }
}

/// Calls `check` with each webhook of a text that is a configuration, and its section.
fn each(
    text: &str,
    config: &Config,
    mut check: impl FnMut(&WebhookConfig, &Section<'_>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let Ok(sections) = DeTable::parse(text) else {
        // It has been read before.
        return Ok(());
    };
    let found = sections
        .get_ref()
        .iter()
        .find(|(key, _)| key.get_ref() == "webhooks");
    let Some(DeValue::Array(tables)) = found.map(|(_, value)| value.get_ref()) else {
        return Ok(());
    };
    for (webhook, table) in config.webhooks.iter().zip(tables.iter()) {
        if let DeValue::Table(keys) = table.get_ref() {
            check(webhook, &Section(keys))?;
        }
    }
    Ok(())
}

/// Checks what must hold between the keys of a webhook, and between webhooks.
pub(super) fn check(text: &str, config: &Config) -> Result<(), Fault> {
    let mut names = BTreeMap::new();
    each(text, config, |webhook, section| {
        let at = section.value("name");
        if names.len() == MOST_WEBHOOKS {
            return Err((
                at,
                format!("more than {MOST_WEBHOOKS} webhooks are not possible"),
            ));
        }
        if let Some(earlier) = names.insert(webhook.name.clone(), at) {
            let (line, _) = line_and_column(text, earlier);
            let name = &webhook.name;
            return Err((
                at,
                format!("there is a webhook {name} in line {line} already: each has its own name"),
            ));
        }
        if webhook.ca_file.is_some() && !webhook.url.starts_with("https:") {
            return Err((
                section.value("ca_file"),
                "`ca_file` is for https, but `url` is not: remove it, or change the url".into(),
            ));
        }
        Ok(())
    })
}

/// Checks the files that webhooks name.
pub(super) fn check_all_files(text: &str, config: &Config) -> Result<(), Fault> {
    each(text, config, |webhook, section| {
        check_files(webhook).map_err(|error| (section.value(error.key()), error.to_string()))
    })
}
