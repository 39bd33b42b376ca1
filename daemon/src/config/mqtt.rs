//! The sections `[[mqtt]]`: brokers that messages and states are published to.

use std::path::PathBuf;
use std::time::Duration;

use relief_api::WebhookEvent;
use serde::{Deserialize, Deserializer, de::Error};

use super::receivers::{KeyFault, Retry, check_ca_file, default_events, default_timeout_ms};
use super::value;
use crate::receivers::shown_url;

/// Ports that brokers listen on unless the address has another.
const PORT: u16 = 1883;
const SECURE_PORT: u16 = 8883;
/// Bytes of a topic's beginning.
const MOST_PREFIX_BYTES: usize = 200;

/// A broker, and what it is told of.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MqttConfig {
    /// Its name; safe in a path and on a command line.
    #[serde(deserialize_with = "value::broker_name")]
    pub name: String,
    /// Where it is: `mqtt://HOST` or `mqtts://HOST`, with a port or without.
    #[serde(deserialize_with = "url")]
    pub url: String,
    /// What every topic begins with; `relief/` and the machine's name unless set.
    #[serde(default, deserialize_with = "prefix")]
    pub topic_prefix: Option<String>,
    /// Who the service is to the broker.
    #[serde(default)]
    pub username: Option<String>,
    /// File with the password.
    #[serde(default)]
    pub password_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that
    /// the machine trusts.
    #[serde(default)]
    pub ca_file: Option<PathBuf>,
    /// What it is told of.
    #[serde(default = "default_events", deserialize_with = "value::webhook_events")]
    pub events: Vec<WebhookEvent>,
    /// How long an attempt may take, with all that belongs to it.
    #[serde(
        default = "default_timeout_ms",
        deserialize_with = "value::webhook_milliseconds"
    )]
    pub timeout_ms: u32,
    /// When a message is tried again; no key of the file.
    #[serde(skip)]
    pub retry: Retry,
}

/// Where a broker is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) is_secure: bool,
    pub(crate) host: String,
    pub(crate) port: u16,
}

impl MqttConfig {
    /// A broker with everything else as it is by default.
    #[must_use]
    pub fn new(name: &str, url: &str) -> Self {
        Self {
            name: name.to_owned(),
            url: url.to_owned(),
            topic_prefix: None,
            username: None,
            password_file: None,
            ca_file: None,
            events: default_events(),
            timeout_ms: default_timeout_ms(),
            retry: Retry::default(),
        }
    }

    /// How long an attempt may take.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms.into())
    }

    /// What every topic begins with, on a machine of this name.
    pub(crate) fn prefix(&self, machine: &str) -> String {
        let own = self.topic_prefix.clone();
        own.unwrap_or_else(|| format!("relief/{machine}"))
    }

    pub(crate) fn place(&self) -> Place {
        // It was read before.
        parse(&self.url).unwrap_or(Place {
            is_secure: true,
            host: String::new(),
            port: SECURE_PORT,
        })
    }

    pub(super) fn check(&self) -> Result<(), KeyFault> {
        if self.password_file.is_some() && self.username.is_none() {
            return Err((
                "password_file",
                "`password_file` is for a `username`, and there is none: add it".into(),
            ));
        }
        check_ca_file(self.ca_file.as_deref(), self.place().is_secure, "mqtts")
    }
}

/// Reads an address; tells what is wrong with it otherwise.
fn parse(text: &str) -> Result<Place, &'static str> {
    let (scheme, rest) = text.split_once("://").ok_or("is no URL")?;
    let is_secure = match scheme {
        "mqtt" => false,
        "mqtts" => true,
        _ => return Err("begins with neither mqtt:// nor mqtts://"),
    };
    if rest.contains('@') {
        return Err(
            "holds a name or password, which others would see: use `username` and \
                    `password_file`",
        );
    }
    let rest = rest.strip_suffix('/').unwrap_or(rest);
    if rest.contains(['/', '?', '#']) {
        return Err("has a path, which brokers do not: set `topic_prefix`");
    }
    let bracketed = rest.rfind(']').map_or(0, |end| end + 1);
    let (host, port) = match rest[bracketed..].rfind(':') {
        Some(colon) => {
            let (host, port) = rest.split_at(bracketed + colon);
            let port = port[1..]
                .parse()
                .map_err(|_| "has no number for its port")?;
            (host, port)
        }
        None if is_secure => (rest, SECURE_PORT),
        None => (rest, PORT),
    };
    let is_host = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
    if host.is_empty() || !host.chars().all(is_host) {
        return Err("names no host");
    }
    Ok(Place {
        is_secure,
        host: host.to_owned(),
        port,
    })
}

/// What is refused is told without what may be secret in it: others see the log.
fn url<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    match parse(&text) {
        Ok(_) => Ok(text),
        Err(why) => Err(D::Error::custom(format!(
            "{:?} {why}: a URL such as \"mqtts://broker.lab.example\" is needed",
            shown_url(&text)
        ))),
    }
}

/// Names of topics without what has a meaning in what others subscribe to.
fn prefix<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let is_level = |level: &str| !level.is_empty() && !level.contains(['+', '#', '\0']);
    let begins = !text.starts_with('$') && text.len() <= MOST_PREFIX_BYTES;
    if begins && text.split('/').all(is_level) {
        return Ok(Some(text));
    }
    Err(D::Error::custom(format!(
        "{text:?} is nothing that topics can begin with: names with `/` between them are possible, \
         without `+` and `#`, no `$` first, such as \"lab/relief\""
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_brokers() {
        let place = |is_secure: bool, host: &str, port: u16| {
            Ok(Place {
                is_secure,
                host: host.to_owned(),
                port,
            })
        };
        for (text, read) in [
            ("mqtt://lab.example", place(false, "lab.example", 1883)),
            ("mqtts://lab.example/", place(true, "lab.example", 8883)),
            ("mqtts://127.0.0.1:99", place(true, "127.0.0.1", 99)),
            ("mqtt://[::1]", place(false, "[::1]", 1883)),
            ("mqtt://[::1]:99", place(false, "[::1]", 99)),
            ("lab.example", Err("is no URL")),
            (
                "https://lab.example",
                Err("begins with neither mqtt:// nor mqtts://"),
            ),
            ("mqtt://lab.example:port", Err("has no number for its port")),
            (
                "mqtt://lab.example:70000",
                Err("has no number for its port"),
            ),
            ("mqtt://", Err("names no host")),
            ("mqtt://:99", Err("names no host")),
            ("mqtt://a b", Err("names no host")),
        ] {
            assert_eq!(parse(text), read, "{text}");
        }
        for (text, why) in [
            ("mqtt://a:hunter2@lab.example", "holds a name or password"),
            ("mqtt://lab.example/topic", "set `topic_prefix`"),
        ] {
            assert!(parse(text).unwrap_err().contains(why), "{text}");
        }
    }
}
