//! Webhooks: a message is posted, signed, and what comes back is put in plain words.

mod secret;
mod shown;
mod words;

use std::io::Read;

use jiff::Timestamp;
use relief_api::{DeliveryAttempt, WebhookKind};
use rustls::crypto::ring;
use rustls::pki_types::CertificateDer;
use ureq::http::{Request, Response, header};
use ureq::tls::{Certificate, RootCerts, TlsConfig};
use ureq::{Agent, Body};

use super::files::{FileError, authorities_in, authorities_of_the_machine};
use super::receiver::{Receiver, Settings, Verdict, Way};
use super::words::printable;
use crate::config::WebhookConfig;
use crate::store::Message;
use secret::Secret;
pub(crate) use shown::shown_url;
use shown::{shown_host, shown_location, without_path};
use words::{GONE, MOST_HEAD_BYTES, refusal, told};

/// Bytes of an answer that are looked at, where it is a refusal; of others none is.
const MOST_ANSWER_BYTES: u64 = 1024;

/// Carries a request to a receiver, and its answer back.
trait Carrier: Send + Sync {
    fn carry(&self, request: Request<&str>) -> Result<Response<Body>, ureq::Error>;
}

impl Carrier for Agent {
    fn carry(&self, request: Request<&str>) -> Result<Response<Body>, ureq::Error> {
        self.run(request)
    }
}

/// A webhook: a URL that messages are posted to, signed.
struct Webhook {
    config: WebhookConfig,
    secret: Secret,
    carrier: Box<dyn Carrier>,
}

/// Reads the files that the webhook names: the secret, and whose certificates are trusted if
/// not those that the machine trusts.
fn read_files(
    config: &WebhookConfig,
) -> Result<(Secret, Option<Vec<CertificateDer<'static>>>), FileError> {
    let secret = Secret::read(&config.secret_file)?;
    let own = config.ca_file.as_deref().map(authorities_in).transpose()?;
    Ok((secret, own))
}

/// Looks at the files that a webhook names.
pub(crate) fn check_files(config: &WebhookConfig) -> Result<(), FileError> {
    read_files(config).map(drop)
}

/// A receiver that is reached as the webhook says.
pub(super) fn receiver(config: &WebhookConfig) -> Result<Receiver, FileError> {
    let (secret, own) = read_files(config)?;
    // Where another part of the process has chosen one, that will do.
    let _ = ring::default_provider().install_default();
    let authorities = match own {
        Some(own) => own,
        None if config.url.starts_with("https:") => authorities_of_the_machine(),
        None => Vec::new(),
    };
    let authorities: Vec<Certificate<'static>> = authorities
        .iter()
        .map(|certificate| Certificate::from_der(certificate).to_owned())
        .collect();
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
    let settings = Settings {
        name: config.name.clone(),
        kind: WebhookKind::Webhook,
        shown: shown_url(&config.url),
        events: config.events.clone(),
        timeout: config.timeout(),
        retry: config.retry,
    };
    let webhook = Webhook {
        config: config.clone(),
        secret,
        carrier: Box::new(agent),
    };
    Ok(Receiver::new(settings, webhook))
}

impl Way for Webhook {
    /// Posts a message, and notes what comes back.
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        let sent = self
            .signed(&message.delivery.id, &message.body)
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
}

impl Webhook {
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

/// The first words of an answer of the receiver at this address.
fn beginning(body: impl Read, url: &str) -> Option<String> {
    let mut bytes = Vec::new();
    // What came before an error is kept.
    let _ = body.take(MOST_ANSWER_BYTES).read_to_end(&mut bytes);
    let text = without_path(url, &String::from_utf8_lossy(&bytes));
    let text = printable(text.as_bytes());
    (!text.is_empty()).then_some(text)
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
}
