//! The sections `[[mail]]`: people who are written to.

use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

use lettre::message::Mailbox;
use relief_api::WebhookEvent;
use serde::{Deserialize, Deserializer, de::Error};

use super::receivers::{KeyFault, Retry, default_events};
use super::value;

/// People whom one section writes to.
const MOST_ADDRESSES: usize = 32;

/// How a mail server is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MailSecurity {
    /// In plain text until both have agreed on TLS; not at all without.
    #[default]
    Starttls,
    /// By TLS from the beginning.
    Tls,
    /// In plain text, to this machine only.
    None,
}

/// A mail server, and whom it is given mails for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MailConfig {
    /// Its name; safe in a path and on a command line.
    #[serde(deserialize_with = "value::mail_name")]
    pub name: String,
    /// The server's host.
    #[serde(deserialize_with = "server")]
    pub server: String,
    /// Its port; unless set, the usual one.
    #[serde(default)]
    pub port: Option<u16>,
    /// How it is spoken to.
    #[serde(default)]
    pub security: MailSecurity,
    /// Who the service is to the server.
    #[serde(default)]
    pub username: Option<String>,
    /// File with the password.
    #[serde(default)]
    pub password_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that
    /// the machine trusts.
    #[serde(default)]
    pub ca_file: Option<PathBuf>,
    /// Who writes.
    #[serde(deserialize_with = "address")]
    pub from: String,
    /// Who is written to.
    #[serde(deserialize_with = "addresses")]
    pub to: Vec<String>,
    /// Of what.
    #[serde(default = "default_events", deserialize_with = "value::webhook_events")]
    pub events: Vec<WebhookEvent>,
    /// How long an attempt may take, with all that belongs to it.
    #[serde(
        default = "patient_ms",
        deserialize_with = "value::webhook_milliseconds"
    )]
    pub timeout_ms: u32,
    /// When a message is tried again; no key of the file.
    #[serde(skip)]
    pub retry: Retry,
}

/// Many servers keep those waiting whom they do not know.
fn patient_ms() -> u32 {
    25_000
}

impl MailConfig {
    /// A section with everything else as it is by default.
    #[must_use]
    pub fn new(name: &str, server: &str, from: &str, to: &[&str]) -> Self {
        Self {
            name: name.to_owned(),
            server: server.to_owned(),
            port: None,
            security: MailSecurity::default(),
            username: None,
            password_file: None,
            ca_file: None,
            from: from.to_owned(),
            to: to.iter().map(|&to| to.to_owned()).collect(),
            events: default_events(),
            timeout_ms: patient_ms(),
            retry: Retry::default(),
        }
    }

    /// The server's port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port.unwrap_or(match self.security {
            MailSecurity::Starttls => 587,
            MailSecurity::Tls => 465,
            MailSecurity::None => 25,
        })
    }

    /// How long an attempt may take.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms.into())
    }

    pub(super) fn check(&self) -> Result<(), KeyFault> {
        match (&self.username, &self.password_file) {
            (None, Some(_)) => {
                return Err((
                    "password_file",
                    "`password_file` is for a `username`, and there is none: add it".into(),
                ));
            }
            (Some(_), None) => {
                return Err((
                    "username",
                    "a `username` needs a `password_file`: add it, or remove the name".into(),
                ));
            }
            _ => {}
        }
        if self.security != MailSecurity::None {
            return Ok(());
        }
        if !is_here(&self.server) {
            return Err((
                "security",
                format!(
                    "mails, and the password with them, would go to {} in plain text: \"starttls\" \
                     and \"tls\" are possible, \"none\" only to localhost",
                    self.server
                ),
            ));
        }
        match self.ca_file {
            Some(_) => Err((
                "ca_file",
                "`ca_file` is for TLS, but `security` is \"none\": remove it".into(),
            )),
            None => Ok(()),
        }
    }
}

/// Whether nothing that is sent there leaves this machine.
fn is_here(server: &str) -> bool {
    let address = server.parse::<IpAddr>();
    server == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

fn server<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "-._:".contains(c);
    let is_host = !text.is_empty() && text.chars().all(plain);
    // Of the colons only those of an address.
    if is_host && (!text.contains(':') || text.parse::<IpAddr>().is_ok()) {
        return Ok(text);
    }
    Err(D::Error::custom(format!(
        "{text:?} is no name of a host: write it as in \"mail.lab.example\", and the port as `port`"
    )))
}

fn check_address(text: &str) -> Result<(), String> {
    let read = text.parse::<Mailbox>();
    read.map(drop).map_err(|error| {
        format!(
            "{text:?} is no address of a mail ({error}): write it as in \"Lab <lab@example.org>\""
        )
    })
}

fn address<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    check_address(&text).map_err(D::Error::custom)?;
    Ok(text)
}

fn addresses<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let all = Vec::<String>::deserialize(deserializer)?;
    if !(1..=MOST_ADDRESSES).contains(&all.len()) {
        return Err(D::Error::custom(format!(
            "{} addresses: 1 to {MOST_ADDRESSES} are possible",
            all.len()
        )));
    }
    for address in &all {
        check_address(address).map_err(D::Error::custom)?;
    }
    Ok(all)
}
