//! Who is told: a message is posted, signed, and what comes back is put in plain words.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::Instant;

use jiff::Timestamp;
use relief_api::DeliveryAttempt;
use rustls::crypto::ring;
use ureq::Agent;
use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};

use super::FileError;
use super::secret::Secret;
use super::words::{GONE, MOST_HEAD_BYTES, refusal, told};
use crate::config::WebhookConfig;
use crate::ids::now;

/// Bytes of an answer that are looked at, where it is a refusal; of others none is.
const MOST_ANSWER_BYTES: u64 = 1024;
/// Characters of them that are kept.
const MOST_ANSWER_CHARS: usize = 200;
/// A file with more is no file of certificates.
const MOST_CA_BYTES: u64 = 1 << 20;

/// What becomes of a message after an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It was taken.
    Delivered,
    /// It was not, and may be later.
    Again,
    /// The receiver wants no more.
    Gone,
}

/// Who is told, and how.
pub(super) struct Receiver {
    pub(super) config: WebhookConfig,
    secret: Secret,
    agent: Agent,
}

impl fmt::Debug for Receiver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Receiver")
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

impl Receiver {
    /// Reads the files that the webhook names.
    pub(super) fn new(config: &WebhookConfig) -> Result<Self, FileError> {
        let secret = Secret::read(&config.secret_file)?;
        // Where another part of the process has chosen one, that will do.
        let _ = ring::default_provider().install_default();
        let authorities = match &config.ca_file {
            Some(path) => authorities_in(path)?,
            None if config.url.starts_with("https:") => authorities_of_the_machine(),
            None => Vec::new(),
        };
        let tls = TlsConfig::builder().root_certs(RootCerts::from(authorities));
        let agent = Agent::config_builder()
            .tls_config(tls.build())
            .timeout_global(Some(config.timeout()))
            .http_status_as_error(false)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .max_response_header_size(MOST_HEAD_BYTES)
            // Messages are far between, and no connection is kept open for the next.
            .max_idle_connections(0)
            .proxy(None)
            .user_agent(concat!("reliefd/", env!("CARGO_PKG_VERSION")))
            .build()
            .new_agent();
        Ok(Self {
            config: config.clone(),
            secret,
            agent,
        })
    }

    /// Posts a message, and waits for what comes back, for no longer than the timeout.
    pub(super) fn post(&self, id: &str, body: &str) -> (DeliveryAttempt, Verdict) {
        let at = now();
        let begun = Instant::now();
        let unix_s = Timestamp::now().as_second();
        let sent = self
            .agent
            .post(&self.config.url)
            .content_type("application/json")
            .header("webhook-id", id)
            .header("webhook-timestamp", unix_s.to_string())
            .header("webhook-signature", self.secret.signature(id, unix_s, body))
            .send(body);
        let mut attempt = DeliveryAttempt {
            at,
            milliseconds: 0,
            status: None,
            error: None,
            answer: None,
        };
        let verdict = match sent {
            Err(error) => {
                attempt.error = Some(told(&error, &self.host(), self.config.timeout()));
                Verdict::Again
            }
            Ok(mut response) => {
                let status = response.status();
                attempt.status = Some(status.as_u16());
                if status.is_success() {
                    Verdict::Delivered
                } else {
                    let location = response.headers().get("location");
                    let location = location.map(|to| printable(to.as_bytes()));
                    attempt.error = Some(refusal(status.as_u16(), location.as_deref()));
                    attempt.answer = beginning(response.body_mut().as_reader());
                    match status.as_u16() {
                        GONE => Verdict::Gone,
                        _ => Verdict::Again,
                    }
                }
            }
        };
        attempt.milliseconds = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        (attempt, verdict)
    }

    /// Host and port, for messages.
    fn host(&self) -> String {
        let uri = self.config.url.parse::<ureq::http::Uri>().ok();
        let authority = uri.as_ref().and_then(|uri| uri.authority());
        authority.map_or_else(|| self.config.url.clone(), ToString::to_string)
    }
}

/// The certificates in a file.
fn authorities_in(path: &Path) -> Result<Vec<Certificate<'static>>, FileError> {
    let failed = |message: String| FileError {
        key: "ca_file",
        message,
    };
    let shown = path.display();
    let mut text = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MOST_CA_BYTES).read_to_end(&mut text))
        .map_err(|error| failed(format!("cannot read the certificates in {shown}: {error}")))?;
    let mut found = Vec::new();
    for item in parse_pem(&text) {
        match item {
            Ok(PemItem::Certificate(certificate)) => found.push(certificate),
            Ok(_) => {}
            Err(error) => {
                return Err(failed(format!(
                    "{shown} holds no PEM certificates: {error}"
                )));
            }
        }
    }
    if found.is_empty() {
        return Err(failed(format!(
            "{shown} holds no PEM certificate (BEGIN CERTIFICATE): name the file with that of the \
             authority"
        )));
    }
    Ok(found)
}

/// Those that the machine trusts, as they are now.
fn authorities_of_the_machine() -> Vec<Certificate<'static>> {
    let found = rustls_native_certs::load_native_certs();
    for error in &found.errors {
        tracing::warn!(%error, "cannot read a certificate of an authority");
    }
    let certificates = found.certs.iter();
    certificates
        .map(|certificate| Certificate::from_der(certificate).to_owned())
        .collect()
}

/// The first words of an answer.
fn beginning(body: impl Read) -> Option<String> {
    let mut bytes = Vec::new();
    // What came before an error is kept.
    let _ = body.take(MOST_ANSWER_BYTES).read_to_end(&mut bytes);
    let text = printable(&bytes);
    (!text.is_empty()).then_some(text)
}

/// One line of what somebody else wrote.
fn printable(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let words: Vec<&str> = text
        .split(|c: char| c.is_whitespace() || c.is_control())
        .filter(|word| !word.is_empty())
        .collect();
    words.join(" ").chars().take(MOST_ANSWER_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_others_wrote_is_one_short_line() {
        assert_eq!(printable(b" a\r\n\x1b[31mb\0c\xff "), "a [31mb c\u{fffd}");
        let long = "\u{e4}".repeat(5_000);
        assert_eq!(beginning(long.as_bytes()).unwrap().chars().count(), 200);
        assert_eq!(beginning(&b" \n"[..]), None);
    }

    #[test]
    fn files_of_certificates_hold_some() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        let refused = || authorities_in(&path).map(|found| found.len()).unwrap_err();
        assert!(
            refused()
                .to_string()
                .contains("cannot read the certificates in")
        );
        assert_eq!(refused().key, "ca_file");
        for text in [
            "",
            "nothing",
            "-----BEGIN CERTIFICATE-----\n!\n-----END CERTIFICATE-----\n",
        ] {
            std::fs::write(&path, text).unwrap();
            let error = refused().to_string();
            assert!(error.contains("holds no PEM certificate"), "{error}");
        }
        let own = rcgen::generate_simple_self_signed(["a.example".to_owned()]).unwrap();
        std::fs::write(&path, own.cert.pem().repeat(2)).unwrap();
        assert_eq!(authorities_in(&path).unwrap().len(), 2);
    }
}
