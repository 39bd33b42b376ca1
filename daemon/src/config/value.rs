//! Values that are checked while they are read, so that a refusal knows its line.

use std::net::SocketAddr;

use axum::http::Uri;
use relief_api::WebhookEvent;
use serde::{Deserialize, Deserializer, de::Error};

use crate::receivers::shown_url;

/// A whole number within bounds; the text names what is counted.
fn bounded<'de, D: Deserializer<'de>>(
    deserializer: D,
    low: u32,
    high: u32,
    unit: &str,
) -> Result<u32, D::Error> {
    let number = i64::deserialize(deserializer)?;
    u32::try_from(number)
        .ok()
        .filter(|n| (low..=high).contains(n))
        .ok_or_else(|| {
            D::Error::custom(format!(
                "{number} is out of range: {low} to {high}{unit} are possible"
            ))
        })
}

pub(super) fn baud<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 1_200, 12_000_000, " bits per second")
}

/// Most characters of a scanner's name: it stands in names of files and threads.
const MOST_NAME_CHARS: usize = 32;

/// Names of scanners stand in names of files, in paths of the API and on command lines.
pub(super) fn check_scanner_name(name: &str) -> Result<(), String> {
    check_name(name, "scanner")
}

fn check_name(name: &str, of_what: &str) -> Result<(), String> {
    let of_file = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    let begins = name.starts_with(|c: char| c.is_ascii_alphanumeric());
    if begins && name.len() <= MOST_NAME_CHARS && name.chars().all(of_file) {
        return Ok(());
    }
    Err(format!(
        "{name:?} is no name for a {of_what}: 1 to {MOST_NAME_CHARS} letters (a to z, A to Z), \
         digits, `-` and `_` are possible, a letter or digit first"
    ))
}

pub(super) fn scanner_name<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let name = String::deserialize(deserializer)?;
    check_scanner_name(&name).map_err(D::Error::custom)?;
    Ok(Some(name))
}

/// A name that is safe in a path and on a command line.
fn safe_name<'de, D: Deserializer<'de>>(
    deserializer: D,
    of_what: &str,
) -> Result<String, D::Error> {
    let name = String::deserialize(deserializer)?;
    check_name(&name, of_what).map_err(D::Error::custom)?;
    Ok(name)
}

pub(super) fn webhook_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    safe_name(deserializer, "webhook")
}

pub(super) fn broker_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    safe_name(deserializer, "broker")
}

pub(super) fn hook_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    safe_name(deserializer, "hook")
}

pub(super) fn upload_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    safe_name(deserializer, "upload")
}

/// Patterns of names of files: at least one, and each of them one.
pub(super) fn patterns<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<String>, D::Error> {
    let patterns = Vec::<String>::deserialize(deserializer)?;
    if patterns.is_empty() {
        let told = "without patterns nothing goes there: leave the key out for all files";
        return Err(D::Error::custom(told));
    }
    for pattern in &patterns {
        glob::Pattern::new(pattern).map_err(|error| {
            D::Error::custom(format!(
                "{pattern:?} is no pattern of names such as \"*.igs\": {error}"
            ))
        })?;
    }
    Ok(patterns)
}

/// Where an object store is.
pub(super) fn object_store<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    if text.parse::<Uri>().as_ref().is_ok_and(is_plain) {
        return Ok(Some(text));
    }
    Err(D::Error::custom(format!(
        "{:?} is no address of an object store: one such as \"https://s3.lab.example\" is needed, \
         without a name or password, which belong into `key_file`",
        shown_url(&text)
    )))
}

/// A machine, as programs are told of it: nothing that they could take for an option.
pub(super) fn host<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    plain_word(deserializer, "name or address of a machine", ".-:_")
}

pub(super) fn user<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    plain_word(deserializer, "name of a user", ".-_@")
}

fn plain_word<'de, D: Deserializer<'de>>(
    deserializer: D,
    what: &str,
    beside: &str,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || beside.contains(c);
    if !text.is_empty() && !text.starts_with('-') && text.chars().all(is_plain) {
        return Ok(Some(text));
    }
    Err(D::Error::custom(format!(
        "{text:?} is no {what}: letters, digits and `{beside}` are possible, and no `-` first"
    )))
}

pub(super) fn hook_seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 1, 86_400, " s")
}

pub(super) fn hook_megabytes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 1, 1_000_000, " MB")
}

pub(super) fn hook_processes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 16, 65_536, " processes")
}

pub(super) fn mail_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    safe_name(deserializer, "mail")
}

/// Where browsers find the page. It stands in mails, so that nothing secret may be in it.
pub(super) fn public_url<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let uri = text.parse::<Uri>().ok();
    if uri.as_ref().is_some_and(is_plain) && !text.contains('#') {
        return Ok(Some(text));
    }
    Err(D::Error::custom(format!(
        "{:?} is no address of the page: one such as \"https://bench.lab.example\" is needed, \
         without a name or password, and nothing behind `?` or `#`",
        shown_url(&text)
    )))
}

/// Where an OpenTelemetry collector takes what it is told.
pub(super) fn collector<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    if text.parse::<Uri>().as_ref().is_ok_and(is_plain) {
        return Ok(Some(text));
    }
    Err(D::Error::custom(format!(
        "{:?} is no address of a collector: one such as \"http://localhost:4318\" is needed, \
         without a name or password, which belong into `headers_file`",
        shown_url(&text)
    )))
}

/// Whether it is one of HTTP without anything secret in it.
fn is_plain(uri: &Uri) -> bool {
    let has_scheme = matches!(uri.scheme_str(), Some("http" | "https"));
    let host = uri.authority().map(|authority| authority.as_str());
    has_scheme && host.is_some_and(|host| !host.contains('@')) && uri.query().is_none()
}

/// Where to post to. What is refused is told without what may be secret in it: others see the log.
pub(super) fn webhook_url<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    let refused = |why: &str| {
        Err(D::Error::custom(format!(
            "{:?} {why}: a URL such as \"https://lab.example/relief\" is needed",
            shown_url(&text)
        )))
    };
    let Ok(uri) = text.parse::<Uri>() else {
        return refused("is no URL");
    };
    if !matches!(uri.scheme_str(), Some("http" | "https")) {
        return refused("begins with neither http:// nor https://");
    }
    match uri.authority() {
        Some(authority) if authority.as_str().contains('@') => {
            refused("holds a name or password, which the receiver is not told and others would see")
        }
        // Also what is meant to be a password, and ends too early to be one.
        Some(authority)
            if authority.port_u16().is_none() && authority.as_str() != authority.host() =>
        {
            refused("has no number for its port")
        }
        Some(authority) if !authority.host().is_empty() => Ok(text),
        _ => refused("names no host"),
    }
}

pub(super) fn webhook_milliseconds<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<u32, D::Error> {
    // Shorter than the command line waits for the answer to a test.
    bounded(deserializer, 100, 25_000, " ms")
}

/// What a webhook is told of: at least something, and nothing twice.
pub(super) fn webhook_events<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<WebhookEvent>, D::Error> {
    let names = Vec::<String>::deserialize(deserializer)?;
    let known = || WebhookEvent::CHOICES.map(WebhookEvent::as_str).join(", ");
    if names.is_empty() {
        return Err(D::Error::custom(format!(
            "without events nothing is told: choose from {}, or remove the section",
            known()
        )));
    }
    let mut events = Vec::new();
    for name in names {
        let found = WebhookEvent::CHOICES
            .into_iter()
            .find(|event| event.as_str() == name);
        let Some(event) = found else {
            return Err(D::Error::custom(format!(
                "there is no event `{name}`; known are: {}",
                known()
            )));
        };
        if !events.contains(&event) {
            events.push(event);
        }
    }
    Ok(events)
}

/// A serial number as USB devices have them; an empty one would mean any device, by mistake.
pub(super) fn serial_number<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    if text.trim().is_empty() {
        return Err(D::Error::custom(
            "the serial number is empty: leave the key out to take any scanner",
        ));
    }
    Ok(Some(text))
}

pub(super) fn milliseconds<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 10, 600_000, " ms").map(Some)
}

pub(super) fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 0, 604_800, " s").map(Some)
}

pub(super) fn attempts<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 1, 100, "").map(Some)
}

pub(super) fn credits<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 2, 1_024, " columns").map(Some)
}

pub(super) fn sync_columns<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 1, 1_024, " columns")
}

pub(super) fn sync_ms<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 0, 1_000, " ms")
}

pub(super) fn reserve_mb<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    bounded(deserializer, 0, 1_000_000, " MB")
}

pub(super) fn megabytes<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 1, 1_000_000_000, " MB").map(Some)
}

pub(super) fn days<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    bounded(deserializer, 1, 36_500, " days").map(Some)
}

pub(super) fn connections<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    bounded(deserializer, 1, 1_024, "").map(|n| n as usize)
}

pub(super) fn http_milliseconds<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<u32, D::Error> {
    bounded(deserializer, 100, 600_000, " ms")
}

/// Names of hosts, in lower case.
pub(super) fn host_names<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<String>, D::Error> {
    let names = Vec::<String>::deserialize(deserializer)?;
    match names.iter().find(|name| !is_host_name(name)) {
        Some(wrong) => Err(D::Error::custom(format!(
            "`{wrong}` is no name of a host: write it as in \"bench.lab.example\", without scheme \
             and port"
        ))),
        None => Ok(names.iter().map(|name| name.to_ascii_lowercase()).collect()),
    }
}

/// Letters, digits, `-` and dots, as names of hosts have (RFC 1123, section 2.1).
pub(crate) fn is_host_name(name: &str) -> bool {
    let label = |label: &str| {
        let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'-';
        !label.is_empty() && label.len() <= 63 && label.bytes().all(plain)
    };
    name.len() <= 253 && name.split('.').all(label)
}

pub(super) fn port<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
    let port = bounded(deserializer, 1, u16::MAX.into(), "")?;
    // It is within bounds.
    Ok(u16::try_from(port).unwrap_or(u16::MAX))
}

/// What a service is called in lists: one label of a domain name (RFC 6763, section 4.1.1).
pub(super) fn announced_name<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    if text.trim().is_empty() || text.len() > 63 || text.chars().any(char::is_control) {
        return Err(D::Error::custom(format!(
            "{text:?} is no name to be announced: up to 63 bytes in one line are possible"
        )));
    }
    Ok(Some(text))
}

/// Name of a group; whether there is one is seen when the socket is made.
pub(super) fn group<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(deserializer)?;
    if text.is_empty() || text.contains(['\0', '/', ':']) {
        return Err(D::Error::custom(format!("{text:?} is no name of a group")));
    }
    Ok(Some(text))
}

/// Permissions as `chmod` takes them: for the service's user, and for the group or not.
pub(super) fn socket_mode<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let text = String::deserialize(deserializer)?;
    let mode = match text.as_str() {
        "0600" | "600" => 0o600,
        "0660" | "660" => 0o660,
        _ => {
            return Err(D::Error::custom(format!(
                "\"{text}\" is out of range: \"0660\" (the service's user and the group) and \
                 \"0600\" (its user alone) are possible, since who may use the socket may turn \
                 the laser on"
            )));
        }
    };
    Ok(mode)
}

pub(super) fn workers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    bounded(deserializer, 1, 64, " workers").map(|n| n as usize)
}

pub(super) fn threads<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    bounded(deserializer, 0, 256, " threads").map(|n| n as usize)
}

/// A positive finite number, where one is given.
pub(super) fn positive<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<f64>, D::Error> {
    let Some(number) = Option::<f64>::deserialize(deserializer)? else {
        return Ok(None);
    };
    if number > 0.0 && number.is_finite() {
        Ok(Some(number))
    } else {
        Err(D::Error::custom(format!(
            "{number} is out of range: a positive number is needed"
        )))
    }
}

/// An address that only this machine can reach: tokens go over it in plain text.
pub(super) fn loopback<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<SocketAddr>, D::Error> {
    let Some(text) = Option::<String>::deserialize(deserializer)? else {
        return Ok(None);
    };
    let address: SocketAddr = text.parse().map_err(|_| {
        D::Error::custom(format!(
            "\"{text}\" is no address with a port, such as \"127.0.0.1:7437\""
        ))
    })?;
    if super::is_loopback(&address) {
        Ok(Some(address))
    } else {
        Err(D::Error::custom(format!(
            "{address} can be reached from other machines, and tokens go over it in plain text: \
             use a loopback address such as \"127.0.0.1:{}\"",
            address.port()
        )))
    }
}

/// A filter that `tracing` understands.
pub(super) fn log_filter<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    // Not asked about other letters: it cuts a filter with fields of spans at bytes, which may
    // lie within one, and nothing that could be named in it has any.
    let is_known = || tracing_subscriber::EnvFilter::try_new(&text).is_ok();
    match text.is_ascii() && is_known() {
        true if !text.trim().is_empty() => Ok(text),
        _ => Err(D::Error::custom(format!(
            "\"{text}\" is no log level: use error, warn, info, debug or trace, \
             or a filter such as \"info,reliefd=debug\""
        ))),
    }
}
