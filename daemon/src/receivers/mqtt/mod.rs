//! Brokers: messages are published by MQTT, and how the service and its scanners are is kept there
//! for whoever asks.

mod link;
mod words;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use relief_api::{DeliveryAttempt, ScannerState, WebhookKind};
use rumqttc::{LastWill, MqttOptions, QoS, TlsConfiguration, Transport};
use rustls::pki_types::CertificateDer;
use rustls::{ClientConfig, RootCertStore};

use super::files::{FileError, authorities_in, authorities_of_the_machine, read_password};
use super::receiver::{Receiver, Settings, Verdict, Way};
use super::words::host_name;
use crate::config::{MqttConfig, Place};
use crate::service::lock;
use crate::store::Message;
use link::{Link, Publication};

/// What the status topic holds.
const ONLINE: &str = "online";
const OFFLINE: &str = "offline";
/// How long the broker and this side are silent at most, so that each finds out that the other
/// has gone.
const KEEP_ALIVE_S: u64 = 15;
/// Bytes of a packet: far more than the longest message.
const MOST_PACKET_BYTES: usize = 4 << 20;

/// A broker that messages are published to.
struct Broker {
    prefix: String,
    link: Link,
    /// What was published last of each scanner, and on which connection.
    shown: Mutex<(u64, BTreeMap<String, String>)>,
}

/// What stands in the files that a broker's section names.
#[derive(Default)]
struct Files {
    password: Option<String>,
    authorities: Option<Vec<CertificateDer<'static>>>,
}

fn read_files(config: &MqttConfig) -> Result<Files, FileError> {
    let password = config.password_file.as_deref().map(read_password);
    let authorities = config.ca_file.as_deref().map(authorities_in);
    Ok(Files {
        password: password.transpose()?,
        authorities: authorities.transpose()?,
    })
}

/// Looks at the files that the section of a broker names.
pub(crate) fn check_files(config: &MqttConfig) -> Result<(), FileError> {
    read_files(config).map(drop)
}

/// A receiver that is reached as the section says. It keeps a connection from now on.
pub(super) fn receiver(config: &MqttConfig) -> Result<Receiver, FileError> {
    let files = read_files(config)?;
    let place = config.place();
    let host = host_name();
    let prefix = config.prefix(&host);
    let mut options = MqttOptions::new(
        format!("relief-{host}-{}", config.name),
        place.host.clone(),
        place.port,
    );
    options
        .set_keep_alive(std::time::Duration::from_secs(KEEP_ALIVE_S))
        .set_max_packet_size(MOST_PACKET_BYTES, MOST_PACKET_BYTES)
        // What was not acknowledged is published anew: the messages are kept here, not there.
        .set_clean_session(true)
        .set_last_will(LastWill::new(
            status_topic(&prefix),
            OFFLINE,
            QoS::AtLeastOnce,
            true,
        ));
    if let Some(username) = &config.username {
        options.set_credentials(username, files.password.unwrap_or_default());
    }
    if place.is_secure {
        options.set_transport(Transport::Tls(tls(config, files.authorities)?));
    }
    let settings = Settings {
        name: config.name.clone(),
        kind: WebhookKind::Mqtt,
        shown: format!("{}/{prefix}", shown(&place)),
        events: config.events.clone(),
        timeout: config.timeout(),
        retry: config.retry,
    };
    let online = Publication {
        topic: status_topic(&prefix),
        payload: ONLINE.into(),
        retain: true,
    };
    let offline = Publication {
        payload: OFFLINE.into(),
        ..online.clone()
    };
    let link = Link::begin(&config.name, options, config.timeout(), [online, offline]);
    Ok(Receiver::new(
        settings,
        Broker {
            prefix,
            link,
            shown: Mutex::default(),
        },
    ))
}

fn status_topic(prefix: &str) -> String {
    format!("{prefix}/status")
}

fn shown(place: &Place) -> String {
    let scheme = if place.is_secure { "mqtts" } else { "mqtt" };
    format!("{scheme}://{}:{}", place.host, place.port)
}

/// As webhooks have it: those that the machine trusts, or those of the file.
fn tls(
    config: &MqttConfig,
    own: Option<Vec<CertificateDer<'static>>>,
) -> Result<TlsConfiguration, FileError> {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(own.unwrap_or_else(authorities_of_the_machine));
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let client = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|error| FileError {
            key: "url",
            message: format!("no TLS for {}: {error}", config.name),
        })?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(TlsConfiguration::Rustls(Arc::new(client)))
}

impl Way for Broker {
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        let publication = Publication {
            topic: format!("{}/{}", self.prefix, message.delivery.event.as_str()),
            payload: message.body.clone(),
            retain: false,
        };
        match self.link.publish(publication) {
            Ok(()) => Verdict::Delivered,
            Err(why) => {
                attempt.error = Some(why);
                Verdict::Again
            }
        }
    }

    fn show(&self, scanners: &[ScannerState]) {
        let Some(connection) = self.link.connection() else {
            return;
        };
        let mut shown = lock(&self.shown);
        // Another broker may be behind the same address by now, or one that has forgotten all.
        if shown.0 != connection {
            *shown = (connection, BTreeMap::new());
        }
        for scanner in scanners {
            // States serialise whatever they hold.
            let payload = serde_json::to_string(scanner).unwrap_or_default();
            if shown.1.get(&scanner.name) == Some(&payload) {
                continue;
            }
            let publication = Publication {
                topic: format!("{}/scanners/{}/state", self.prefix, scanner.name),
                payload: payload.clone(),
                retain: true,
            };
            if self.link.show(publication) {
                shown.1.insert(scanner.name.clone(), payload);
            }
        }
    }

    fn close(&self) {
        self.link.close();
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.link.close();
    }
}
