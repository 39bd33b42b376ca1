//! Why a receiver was not told, in plain words, and what to do about it.

use std::time::Duration;

use crate::receivers::words::{of_io, of_tls};

/// What a receiver answers that wants no more messages.
pub(super) const GONE: u16 = 410;
/// Bytes of the head of an answer.
pub(super) const MOST_HEAD_BYTES: usize = 16 * 1024;

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
    use std::io;

    use rustix::io::Errno;

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
