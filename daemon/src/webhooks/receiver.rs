//! Who is told: a message is posted, signed, and what comes back is put in plain words.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use jiff::Timestamp;
use relief_api::DeliveryAttempt;
use rustls::crypto::ring;
use ureq::http::{Request, Response, header};
use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};
use ureq::{Agent, Body};

use super::FileError;
use super::secret::Secret;
use super::shown::{shown_host, shown_location, without_path};
use super::words::{GONE, MOST_HEAD_BYTES, refusal, told};
use crate::config::WebhookConfig;
use crate::error::panic_text;
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

/// Carries a request to a receiver, and its answer back.
pub(super) trait Carrier: Send + Sync {
    fn carry(&self, request: Request<&str>) -> Result<Response<Body>, ureq::Error>;
}

impl Carrier for Agent {
    fn carry(&self, request: Request<&str>) -> Result<Response<Body>, ureq::Error> {
        self.run(request)
    }
}

/// Who is told, and how.
pub(super) struct Receiver {
    pub(super) config: WebhookConfig,
    secret: Secret,
    carrier: Box<dyn Carrier>,
}

impl fmt::Debug for Receiver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Receiver")
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

impl Receiver {
    /// Reads the files that the webhook names: the secret, and whose certificates are trusted if
    /// not those that the machine trusts.
    pub(super) fn read_files(
        config: &WebhookConfig,
    ) -> Result<(Secret, Option<Vec<Certificate<'static>>>), FileError> {
        let secret = Secret::read(&config.secret_file)?;
        let own = config.ca_file.as_deref().map(authorities_in).transpose()?;
        Ok((secret, own))
    }

    /// A receiver that is reached as the webhook says.
    pub(super) fn new(config: &WebhookConfig) -> Result<Self, FileError> {
        let (secret, own) = Self::read_files(config)?;
        // Where another part of the process has chosen one, that will do.
        let _ = ring::default_provider().install_default();
        let authorities = match own {
            Some(own) => own,
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
            carrier: Box::new(agent),
        })
    }

    /// The same receiver, reached in another way.
    #[cfg(test)]
    pub(super) fn over(self, carrier: impl Carrier + 'static) -> Self {
        Self {
            carrier: Box::new(carrier),
            ..self
        }
    }

    /// Posts a message, and waits for what comes back, for no longer than the timeout.
    ///
    /// A defect that an answer sets off costs this attempt and nothing else: no receiver may end
    /// the service, and the scans with it.
    pub(super) fn post(&self, id: &str, body: &str) -> (DeliveryAttempt, Verdict) {
        let mut attempt = DeliveryAttempt {
            at: now(),
            milliseconds: 0,
            status: None,
            error: None,
            answer: None,
        };
        let begun = Instant::now();
        let asked = catch_unwind(AssertUnwindSafe(|| self.ask(id, body, &mut attempt)));
        let verdict = asked.unwrap_or_else(|panic| {
            attempt.error = Some(format!(
                "the attempt ended unexpectedly: {}; this is a defect of the program: please \
                 report it",
                printable(panic_text(&*panic).as_bytes())
            ));
            Verdict::Again
        });
        attempt.milliseconds = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        (attempt, verdict)
    }

    /// Posts a message, and notes what comes back.
    fn ask(&self, id: &str, body: &str, attempt: &mut DeliveryAttempt) -> Verdict {
        let sent = self
            .signed(id, body)
            .and_then(|request| self.carrier.carry(request));
        let mut response = match sent {
            Err(error) => {
                attempt.error = Some(told(
                    &error,
                    &shown_host(&self.config.url),
                    self.config.timeout(),
                ));
                return Verdict::Again;
            }
            Ok(response) => response,
        };
        let status = response.status();
        attempt.status = Some(status.as_u16());
        if status.is_success() {
            return Verdict::Delivered;
        }
        let location = response.headers().get(header::LOCATION);
        let location = location
            .map(|to| shown_location(&self.config.url, &String::from_utf8_lossy(to.as_bytes())))
            .map(|to| printable(to.as_bytes()));
        attempt.error = Some(refusal(status.as_u16(), location.as_deref()));
        // What comes with a redirection only repeats where it leads, in full.
        if !status.is_redirection() {
            attempt.answer = beginning(response.body_mut().as_reader(), &self.config.url);
        }
        match status.as_u16() {
            GONE => Verdict::Gone,
            _ => Verdict::Again,
        }
    }

    fn signed<'a>(&self, id: &str, body: &'a str) -> Result<Request<&'a str>, ureq::Error> {
        let unix_s = Timestamp::now().as_second();
        let request = Request::post(&self.config.url)
            .header(header::CONTENT_TYPE, "application/json")
            .header("webhook-id", id)
            .header("webhook-timestamp", unix_s)
            .header("webhook-signature", self.secret.signature(id, unix_s, body));
        Ok(request.body(body)?)
    }
}

/// The certificates in a file.
fn authorities_in(path: &Path) -> Result<Vec<Certificate<'static>>, FileError> {
    let failed = |message: String| FileError {
        key: "ca_file",
        message,
    };
    let shown = path.display();
    let unread =
        |error: io::Error| failed(format!("cannot read the certificates in {shown}: {error}"));
    // Before it is opened: a pipe might keep whoever does so.
    if !fs::metadata(path).map_err(unread)?.is_file() {
        return Err(failed(format!(
            "{shown} is no file: name one with the certificate of the authority"
        )));
    }
    let mut text = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MOST_CA_BYTES).read_to_end(&mut text))
        .map_err(unread)?;
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

/// The first words of an answer of the receiver at this address.
fn beginning(body: impl Read, url: &str) -> Option<String> {
    let mut bytes = Vec::new();
    // What came before an error is kept.
    let _ = body.take(MOST_ANSWER_BYTES).read_to_end(&mut bytes);
    let text = without_path(url, &String::from_utf8_lossy(&bytes));
    let text = printable(text.as_bytes());
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
        let url = "https://a.example/hunter2";
        let kept = |answer: &[u8]| beginning(answer, url);
        assert_eq!(kept(long.as_bytes()).unwrap().chars().count(), 200);
        assert_eq!(kept(b" \n"), None);
        assert_eq!(kept(b"no\n/hunter2").unwrap(), "no ...");
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
        assert!(
            authorities_in(folder.path())
                .unwrap_err()
                .to_string()
                .contains("is no file")
        );
        let own = rcgen::generate_simple_self_signed(["a.example".to_owned()]).unwrap();
        std::fs::write(&path, own.cert.pem().repeat(2)).unwrap();
        assert_eq!(authorities_in(&path).unwrap().len(), 2);
    }

    #[test]
    fn a_pipe_in_place_of_certificates_keeps_nobody() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        let (kind, mode) = (rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU);
        rustix::fs::mknodat(rustix::fs::CWD, &path, kind, mode, 0).unwrap();
        // Whoever did open it would find that it ends, and say so.
        let ends = std::thread::spawn({
            let path = path.clone();
            move || File::options().write(true).open(path).map(drop)
        });
        let error = authorities_in(&path).unwrap_err();
        // Whoever opens both ends waits for nobody, and the other need not wait any more.
        let both = File::options().read(true).write(true).open(&path).unwrap();
        ends.join().unwrap().unwrap();
        drop(both);
        assert!(error.to_string().contains("is no file"), "{error}");
        assert_eq!(error.key, "ca_file");
    }
}
