//! Why a receiver was not told, in plain words, and what to do about it.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, UdpSocket};
use std::time::Duration;

use rustix::io::Errno;
use rustls::CertificateError;

/// What a receiver answers that wants no more messages.
pub(super) const GONE: u16 = 410;
/// Bytes of the head of an answer.
pub(super) const MOST_HEAD_BYTES: usize = 16 * 1024;

/// What to do where the packaged unit keeps the service from the network.
const NO_NETWORK: &str = "the service may not use the network: install the drop-in network.conf \
                          for reliefd.service (/usr/share/doc/relief/examples/network.conf says \
                          how)";

/// Tells whoever reads the log where webhooks cannot work.
pub(super) fn warn_without_network() {
    let closed = |bound: io::Result<UdpSocket>| bound.is_err_and(|error| is_closed(&error));
    if closed(UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)))
        && closed(UdpSocket::bind((Ipv6Addr::UNSPECIFIED, 0)))
    {
        tracing::warn!("there are webhooks, but {NO_NETWORK}");
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

/// Why the receiver was not reached, and what to do about it.
pub(super) fn told(error: &ureq::Error, host: &str, timeout: Duration) -> String {
    match error {
        ureq::Error::Timeout(_) => {
            format!(
                "{host} did not answer within {} ms (timeout_ms)",
                timeout.as_millis()
            )
        }
        ureq::Error::HostNotFound => format!("there is no host {host}"),
        ureq::Error::LargeResponseHeader(..) => {
            format!("the head of the answer of {host} has more than {MOST_HEAD_BYTES} bytes")
        }
        ureq::Error::Protocol(error) => {
            format!("what {host} answers cannot be read as HTTP: {error}")
        }
        ureq::Error::Rustls(error) => of_tls(error, host),
        ureq::Error::Io(error) => of_io(error, host),
        // It repeats the whole url.
        ureq::Error::BadUri(_) | ureq::Error::RequireHttpsOnly(_) => {
            format!("nothing can be posted to {host}: see to the url")
        }
        other => format!("{host}: {other}"),
    }
}

fn of_io(error: &io::Error, host: &str) -> String {
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

fn of_tls(error: &rustls::Error, host: &str) -> String {
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
        rustls::Error::InvalidMessage(_) => format!("{host} does not speak TLS: is it http?"),
        other => format!("no safe connection to {host}: {other}"),
    }
}

/// What a status that is no success means.
pub(super) fn refusal(status: u16, location: Option<&str>) -> String {
    match (status, location) {
        (GONE, _) => "the receiver wants no more messages (410): remove this webhook".into(),
        (300..=399, Some(to)) => format!(
            "the receiver leads elsewhere ({status}, to {to}), where nobody is told: set url to \
             where messages belong"
        ),
        (401 | 403, _) => format!(
            "the receiver does not trust the message ({status}): has it the same secret, and \
             are both clocks right?"
        ),
        _ => format!("the receiver answered {status}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_network_is_told_with_its_cure() {
        for errno in [Errno::AFNOSUPPORT, Errno::PERM, Errno::ACCESS] {
            let error = io::Error::from_raw_os_error(errno.raw_os_error());
            let told = told(&ureq::Error::Io(error), "lab.example", Duration::ZERO);
            assert!(told.contains("install the drop-in network.conf"), "{told}");
        }
        let error = io::Error::other(
            "failed to lookup address information: Temporary failure in name resolution",
        );
        let told = told(&ureq::Error::Io(error), "lab.example", Duration::ZERO);
        assert!(told.starts_with("cannot find lab.example: "), "{told}");
        assert!(told.contains("network.conf"), "{told}");
    }
}
