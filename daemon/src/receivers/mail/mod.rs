//! Mail: messages as text that a person likes to read, by SMTP.

mod letter;
mod words;

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
use words::told;

/// A mail server, and whom it is given mails for.
struct Mail {
    config: MailConfig,
    machine: String,
    public_url: Option<String>,
    transport: SmtpTransport,
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
        shown: format!("{}:{}", config.server, config.port()),
        events: config.events.clone(),
        timeout: config.timeout(),
        retry: config.retry,
    };
    let mail = Mail {
        config: config.clone(),
        machine,
        public_url: public_url.map(str::to_owned),
        transport: transport.build(),
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
}

/// The configuration was checked when it was read.
fn mailbox(address: &str) -> Result<Mailbox, String> {
    let read = address.parse();
    read.map_err(|error| format!("{address:?} is no address: {error}"))
}

impl Way for Mail {
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        let sent = self.mail(message).and_then(|mail| {
            let server = format!("{}:{}", self.config.server, self.config.port());
            let sent = self.transport.send(&mail);
            sent.map_err(|error| told(&error, &server, self.config.timeout()))
        });
        match sent {
            Ok(answer) => {
                attempt.status = u16::from(answer.code()).into();
                Verdict::Delivered
            }
            Err(why) => {
                attempt.error = Some(why);
                Verdict::Again
            }
        }
    }
}
