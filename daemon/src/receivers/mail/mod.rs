//! Mail: messages as text that a person likes to read, by SMTP.

mod letter;
mod words;

use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};

use lettre::message::header::ContentType;
use lettre::message::{Mailbox, MessageBuilder};
use lettre::transport::smtp::authentication::Credentials;
use lettre::transport::smtp::client::{Certificate, CertificateStore, Tls, TlsParameters};
use lettre::transport::smtp::extension::ClientId;
use lettre::{SmtpTransport, Transport};
use relief_api::{DeliveryAttempt, WebhookKind, WebhookMessage};
use rustls::RootCertStore;
use rustls::pki_types::CertificateDer;

use super::files::{FileError, authorities_in, authorities_of_the_machine, read_password};
use super::receiver::{Receiver, Settings, Verdict, Way};
use super::words::host_name;
use crate::config::{MailConfig, MailSecurity};
use crate::store::Message;
use letter::letter;
use words::{silent, told};

/// Attempts that may be under way: one that a test asked for beside one of the receiver's thread, and
/// two that were given up and have not ended yet.
const MOST_UNDER_WAY: usize = 4;

/// A mail server, and whom it is given mails for.
struct Mail {
    config: MailConfig,
    machine: String,
    public_url: Option<String>,
    transport: SmtpTransport,
    /// Cloned by each attempt that has not come to an end.
    under_way: Arc<()>,
}

/// What stands in the files that a section names.
struct Files {
    password: Option<String>,
    authorities: Option<Vec<CertificateDer<'static>>>,
}

fn read_files(config: &MailConfig) -> Result<Files, FileError> {
    let password = config.password_file.as_deref().map(read_password);
    let authorities = config.ca_file.as_deref().map(authorities_in);
    Ok(Files {
        password: password.transpose()?,
        authorities: authorities.transpose()?,
    })
}

/// Looks at the files that a section names.
pub(crate) fn check_files(config: &MailConfig) -> Result<(), FileError> {
    read_files(config).map(drop)
}

/// A receiver that is reached as the section says.
pub(super) fn receiver(
    config: &MailConfig,
    public_url: Option<&str>,
) -> Result<Receiver, FileError> {
    let files = read_files(config)?;
    let machine = host_name();
    let mut transport = SmtpTransport::builder_dangerous(&config.server)
        .port(config.port())
        .timeout(Some(config.timeout()))
        .hello_name(ClientId::Domain(machine.clone()))
        .tls(tls(config, files.authorities)?);
    if let (Some(username), Some(password)) = (&config.username, files.password) {
        transport = transport.credentials(Credentials::new(username.clone(), password));
    }
    let settings = Settings {
        name: config.name.clone(),
        kind: WebhookKind::Mail,
        shown: shown(config),
        events: config.events.clone(),
        timeout: config.timeout(),
        retry: config.retry,
    };
    let mail = Mail {
        config: config.clone(),
        machine,
        public_url: public_url.map(str::to_owned),
        transport: transport.build(),
        under_way: Arc::new(()),
    };
    Ok(Receiver::new(settings, mail))
}

/// As webhooks have it: those that the machine trusts, or those of the file.
fn tls(config: &MailConfig, own: Option<Vec<CertificateDer<'static>>>) -> Result<Tls, FileError> {
    let make: fn(TlsParameters) -> Tls = match config.security {
        MailSecurity::None => return Ok(Tls::None),
        MailSecurity::Starttls => Tls::Required,
        MailSecurity::Tls => Tls::Wrapper,
    };
    let trusted = own.unwrap_or_else(authorities_of_the_machine);
    let mut parameters =
        TlsParameters::builder(config.server.clone()).certificate_store(CertificateStore::None);
    for authority in trusted {
        // One that cannot be read would have all refused.
        let is_sound = RootCertStore::empty().add(authority.clone()).is_ok();
        if is_sound && let Ok(authority) = Certificate::from_der(authority.to_vec()) {
            parameters = parameters.add_root_certificate(authority);
        }
    }
    let parameters = parameters.build().map_err(|error| FileError {
        key: "server",
        message: format!("no TLS for {}: {error}", config.server),
    })?;
    Ok(make(parameters))
}

impl Mail {
    fn mail(&self, message: &Message) -> Result<lettre::Message, String> {
        let told: WebhookMessage = serde_json::from_str(&message.body)
            .map_err(|error| format!("the message cannot be read any more: {error}"))?;
        let letter = letter(&told, &self.machine, self.public_url.as_deref());
        let mut mail: MessageBuilder = lettre::Message::builder()
            .from(mailbox(&self.config.from)?)
            .subject(letter.subject)
            // Of mails that arrive twice, programs show one.
            .message_id(Some(format!("<{}@{}>", message.delivery.id, self.machine)))
            .header(ContentType::TEXT_PLAIN);
        for to in &self.config.to {
            mail = mail.to(mailbox(to)?);
        }
        let mail = mail.body(letter.text);
        mail.map_err(|error| format!("the mail cannot be written: {error}"))
    }

    /// Gives a mail to the server, and waits for what comes of it, for no longer than the timeout.
    /// Gives the status of the server's answer.
    ///
    /// The library bounds each answer, but not how many there are. So it has a thread of its own,
    /// which goes on for as long as the server plays with it, and nobody waits for it any more.
    fn send(&self, mail: lettre::Message) -> Result<u16, String> {
        let (timeout, server) = (self.config.timeout(), shown(&self.config));
        // Held by the thread until it ends, however it does.
        let place = Arc::clone(&self.under_way);
        // The receiver itself holds one, too.
        if Arc::strong_count(&self.under_way) > MOST_UNDER_WAY + 1 {
            return Err(format!(
                "{server} has not come to an end with earlier mails: is it a mail server?"
            ));
        }
        let (sender, sent) = mpsc::channel();
        let transport = self.transport.clone();
        let thread = std::thread::Builder::new().name(format!("send {}", self.config.name));
        let begun = thread.spawn(move || {
            let _place = place;
            // Nobody may be waiting any more.
            let _ = sender.send(transport.send(&mail));
        });
        begun.map_err(|error| format!("cannot start a thread: {error}"))?;
        match sent.recv_timeout(timeout) {
            Ok(Ok(answer)) => Ok(answer.code().into()),
            Ok(Err(error)) => Err(told(&error, &server, timeout)),
            Err(RecvTimeoutError::Timeout) => Err(silent(&server, timeout)),
            Err(RecvTimeoutError::Disconnected) => Err(format!(
                "the attempt to tell {server} ended unexpectedly; this is a defect of the \
                 program: please report it"
            )),
        }
    }
}

/// The configuration was checked when it was read.
fn mailbox(address: &str) -> Result<Mailbox, String> {
    let read = address.parse();
    read.map_err(|error| format!("{address:?} is no address: {error}"))
}

fn shown(config: &MailConfig) -> String {
    format!("{}:{}", config.server, config.port())
}

impl Way for Mail {
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        match self.mail(message).and_then(|mail| self.send(mail)) {
            Ok(status) => {
                attempt.status = Some(status);
                Verdict::Delivered
            }
            Err(why) => {
                attempt.error = Some(why);
                Verdict::Again
            }
        }
    }
}
