//! Why a mail server does not take mails, in plain words, and what to do about it.

use std::error::Error as _;
use std::io;
use std::time::Duration;

use lettre::transport::smtp::Error;

use crate::receivers::words::{of_io, of_tls, printable};

/// Why this server has not taken a mail.
pub(super) fn told(error: &Error, server: &str, timeout: Duration) -> String {
    if error.is_timeout() {
        return silent(server, timeout);
    }
    if let Some(code) = error.status() {
        let (code, said) = (u16::from(code), said(error));
        return match code {
            530 | 534 | 535 | 538 => format!(
                "{server} does not let the service in ({code}): see to username and \
                 password_file; it said: {said}"
            ),
            550..=553 => format!(
                "{server} does not take mail from or to these addresses ({code}): see to from and \
                 to; it said: {said}"
            ),
            421 | 450..=452 => format!("{server} takes no mail at present ({code}): {said}"),
            _ => format!("{server} refuses the mail ({code}): {said}"),
        };
    }
    // What lies behind it: the system's or the connection's own words.
    let mut cause = error.source();
    while let Some(inner) = cause {
        if let Some(inner) = inner.downcast_ref::<rustls::Error>() {
            return of_tls(inner, server);
        }
        if let Some(inner) = inner.downcast_ref::<io::Error>() {
            return of_io(inner, server);
        }
        cause = inner.source();
    }
    let text = said(error);
    if text.contains("STARTTLS") {
        return format!(
            "{server} offers no STARTTLS, and mails do not go in plain text: set security = \
             \"tls\" if that is its port"
        );
    }
    format!("{server}: {text}")
}

/// Why a server that says nothing, or no end of it, was not told.
pub(super) fn silent(server: &str, timeout: Duration) -> String {
    format!(
        "{server} had not taken the mail within {} ms (timeout_ms)",
        timeout.as_millis()
    )
}

/// What lies behind an error, in one line.
fn said(error: &Error) -> String {
    let text = match error.source() {
        Some(inner) => inner.to_string(),
        None => error.to_string(),
    };
    printable(text.as_bytes())
}
