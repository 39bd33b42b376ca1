//! Why a receiver was not reached, in plain words, and what to do about it.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, UdpSocket};

use rustix::io::Errno;
use rustls::CertificateError;

/// Characters that are kept of what somebody else wrote.
const MOST_ANSWER_CHARS: usize = 200;

/// What to do where the packaged unit keeps the service from the network.
const NO_NETWORK: &str = "the service may not use the network: install the drop-in network.conf \
                          for reliefd.service (/usr/share/doc/relief/examples/network.conf says \
                          how)";

/// Tells whoever reads the log where no receiver can be reached.
pub(super) fn warn_without_network() {
    let closed = |bound: io::Result<UdpSocket>| bound.is_err_and(|error| is_closed(&error));
    if closed(UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)))
        && closed(UdpSocket::bind((Ipv6Addr::UNSPECIFIED, 0)))
    {
        tracing::warn!("there are receivers of messages, but {NO_NETWORK}");
    }
}

/// True for what the sandbox of the packaged unit answers.
fn is_closed(error: &io::Error) -> bool {
    let errno = error.raw_os_error().map(Errno::from_raw_os_error);
    matches!(
        errno,
        Some(Errno::AFNOSUPPORT | Errno::PERM | Errno::ACCESS)
    )
}

pub(super) fn of_io(error: &io::Error, host: &str) -> String {
    let inner = error
        .get_ref()
        .and_then(|e| e.downcast_ref::<rustls::Error>());
    if let Some(inner) = inner {
        return of_tls(inner, host);
    }
    if is_closed(error) {
        return format!("cannot reach {host}: {NO_NETWORK}");
    }
    match error.kind() {
        io::ErrorKind::ConnectionRefused => {
            format!("{host} refuses the connection: is the receiver running?")
        }
        io::ErrorKind::UnexpectedEof | io::ErrorKind::ConnectionReset => {
            format!("{host} closed the connection without an answer")
        }
        io::ErrorKind::NetworkUnreachable | io::ErrorKind::HostUnreachable => {
            format!("cannot reach {host}: {error}; or {NO_NETWORK}")
        }
        // The system's resolver, which has no kind of its own.
        _ if error.to_string().contains("lookup") => {
            format!(
                "cannot find {host}: {error}; see to its name or the name server, or {NO_NETWORK}"
            )
        }
        _ => format!("cannot reach {host}: {error}"),
    }
}

pub(super) fn of_tls(error: &rustls::Error, host: &str) -> String {
    use CertificateError as C;
    match error {
        // Of an authority that was made anew under its old name, only the signature is wrong.
        rustls::Error::InvalidCertificate(C::UnknownIssuer | C::BadSignature) => format!(
            "the certificate of {host} is of no authority that is trusted here: set ca_file to \
             the certificate of the lab's own, or see to the package ca-certificates"
        ),
        rustls::Error::InvalidCertificate(C::Expired | C::ExpiredContext { .. }) => {
            format!("the certificate of {host} has expired, or this machine's clock is wrong")
        }
        rustls::Error::InvalidCertificate(
            C::NotValidForName | C::NotValidForNameContext { .. },
        ) => {
            format!("the certificate of {host} is for another name")
        }
        rustls::Error::InvalidMessage(_) => format!("{host} does not speak TLS: is it meant to?"),
        other => format!("no safe connection to {host}: {other}"),
    }
}

/// One line of what somebody else wrote.
pub(super) fn printable(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let words: Vec<&str> = text
        .split(|c: char| c.is_whitespace() || c.is_control())
        .filter(|word| !word.is_empty())
        .collect();
    words.join(" ").chars().take(MOST_ANSWER_CHARS).collect()
}

/// The machine's name, with nothing in it that topics or headers give a meaning to.
pub(super) fn host_name() -> String {
    let name = rustix::system::uname();
    let plain = |c: char| match c {
        c if c.is_ascii_alphanumeric() || "-._".contains(c) => c,
        _ => '_',
    };
    name.nodename()
        .to_string_lossy()
        .chars()
        .map(plain)
        .collect()
}
