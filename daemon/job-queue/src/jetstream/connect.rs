//! The connection: made for as long as it takes, and again whenever it is lost.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use async_nats::{Client, ClientError, ConnectErrorKind, Event, ServerError, connection};
use tokio::sync::watch;

use super::options::{Options, pause};
use crate::QueueError;

/// How long is waited for an answer after something was forbidden.
const FORBIDDEN: Duration = Duration::from_secs(1);

/// How often the connection was made, and whether it is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Up {
    /// Whether it is there.
    pub(crate) there: bool,
    /// How often it was made.
    pub(crate) times: u64,
}

/// What is known of a connection that is not there, or that something is forbidden on.
#[derive(Debug, Default)]
struct Known {
    client: Option<Client>,
    away_since: Option<Instant>,
    why: String,
    refused: Option<String>,
    forbidden: Option<(Instant, String)>,
}

/// A connection that is made by a task of its own, and told of.
#[derive(Debug)]
pub(crate) struct Link {
    servers: String,
    known: Mutex<Known>,
    up: watch::Sender<Up>,
    /// How often something was forbidden.
    forbidden: watch::Sender<u64>,
}

impl Link {
    /// One that is not there yet.
    pub(crate) fn new(options: &Options) -> Arc<Self> {
        let known = Known {
            away_since: Some(Instant::now()),
            why: "it was not connected yet".to_owned(),
            ..Known::default()
        };
        Arc::new(Self {
            servers: options.shown_servers(),
            known: Mutex::new(known),
            up: watch::Sender::new(Up {
                there: false,
                times: 0,
            }),
            forbidden: watch::Sender::new(0),
        })
    }

    /// Connects, however long it takes. From then on the client itself connects again.
    pub(crate) async fn establish(self: Arc<Self>, options: Options) {
        // Where another part of the process has chosen one, that will do.
        let _ = async_nats::rustls::crypto::ring::default_provider().install_default();
        let (Ok(addresses), Ok(_)) = (options.addresses(), options.connect_options()) else {
            return;
        };
        for attempt in 1.. {
            tokio::time::sleep(pause(attempt)).await;
            let Ok(client) = options.connect_options() else {
                return;
            };
            let told = Arc::downgrade(&self);
            let client = client.event_callback(move |event| {
                let told = told.clone();
                async move {
                    if let Some(link) = told.upgrade() {
                        link.heard(event);
                    }
                }
            });
            match client.connect(addresses.clone()).await {
                Ok(client) => {
                    self.known().client = Some(client);
                    self.connected();
                    return;
                }
                Err(error) => {
                    let refused = matches!(
                        error.kind(),
                        ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication
                    );
                    self.failed(&error.to_string(), refused);
                }
            }
        }
    }

    fn known(&self) -> std::sync::MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn connected(&self) {
        {
            let mut known = self.known();
            known.away_since = None;
            known.refused = None;
        }
        // It may be told by two at once, and is news once.
        self.up.send_if_modified(|up| {
            let is_news = !up.there;
            if is_news {
                up.there = true;
                up.times += 1;
            }
            is_news
        });
    }

    fn failed(&self, why: &str, refused: bool) {
        let mut known = self.known();
        if refused && known.refused.is_none() {
            tracing::error!(servers = %self.servers, "NATS does not accept the login");
        }
        known.refused = refused.then(|| {
            format!(
                "NATS at {} does not accept the login ({why}): compare the token, password, nkey \
                 or credentials of this machine with the server's configuration",
                self.servers
            )
        });
        why.clone_into(&mut known.why);
    }

    fn heard(&self, event: Event) {
        match event {
            // The first one is told by who has the client.
            Event::Connected if self.known().client.is_some() => {
                tracing::info!(servers = %self.servers, "connected with NATS again");
                self.connected();
            }
            Event::Disconnected | Event::Closed => {
                tracing::warn!(servers = %self.servers, "the connection with NATS is lost");
                {
                    let mut known = self.known();
                    known.away_since.get_or_insert_with(Instant::now);
                    "the connection was lost".clone_into(&mut known.why);
                }
                self.up.send_modify(|up| up.there = false);
            }
            Event::ServerError(ServerError::AuthorizationViolation) => {
                self.failed("authorization violation", true);
            }
            Event::ServerError(ServerError::Other(text)) => {
                let lower = text.to_lowercase();
                if lower.contains("permissions violation") {
                    tracing::error!(%text, "NATS forbids what a queue needs");
                    self.known().forbidden = Some((Instant::now(), text));
                    self.forbidden.send_modify(|times| *times += 1);
                } else if lower.contains("authentication") || lower.contains("authorization") {
                    self.failed(&text, true);
                } else {
                    tracing::warn!(%text, "NATS reports an error");
                }
            }
            Event::ClientError(ClientError::Other(text)) => {
                let refused = text.contains("authorization violation") || text.contains("nonce");
                // All that the client says where no connection can be made.
                let text = if text == "IO error" {
                    "nobody answers there"
                } else {
                    &text
                };
                self.failed(text, refused);
            }
            _ => {}
        }
    }

    /// Whether the connection is there.
    pub(crate) fn is_up(&self) -> bool {
        let known = self.known();
        let client = known.client.as_ref();
        client.is_some_and(|client| client.connection_state() == connection::State::Connected)
    }

    /// Since when it is not.
    pub(crate) fn away_since(&self) -> Option<Instant> {
        self.known().away_since
    }

    /// Is told whenever the connection comes or goes.
    pub(crate) fn watch(&self) -> watch::Receiver<Up> {
        self.up.subscribe()
    }

    /// How often the connection was made.
    pub(crate) fn times(&self) -> u64 {
        self.up.borrow().times
    }

    /// The client, if it is connected.
    pub(crate) fn client(&self) -> Result<Client, QueueError> {
        let known = self.known();
        match &known.client {
            Some(client) if client.connection_state() == connection::State::Connected => {
                Ok(client.clone())
            }
            _ => Err(self.away(&known)),
        }
    }

    fn away(&self, known: &Known) -> QueueError {
        match &known.refused {
            Some(refused) => QueueError::Refused(refused.clone()),
            None => QueueError::Away(format!("NATS at {}: {}", self.servers, known.why)),
        }
    }

    /// Ends when the connection does.
    pub(crate) async fn lost(&self) -> QueueError {
        let mut up = self.up.subscribe();
        // From now on: what was is seen by whoever asks for the client.
        up.mark_unchanged();
        while up.changed().await.is_ok() {
            if !up.borrow_and_update().there {
                break;
            }
        }
        self.away(&self.known())
    }

    /// Ends a while after something was forbidden: it may have been what is waited for, which
    /// then never comes, or something else, so that what is waited for comes meanwhile.
    pub(crate) async fn forbidden(&self) -> QueueError {
        let mut forbidden = self.forbidden.subscribe();
        forbidden.mark_unchanged();
        let _ = forbidden.changed().await;
        tokio::time::sleep(FORBIDDEN).await;
        QueueError::Away("NATS does not answer".to_owned())
    }

    /// A server does not answer what it forbids, but tells of it elsewhere: what seems to have
    /// been lost since `begun` may have been forbidden.
    pub(crate) fn or_forbidden(&self, begun: Instant, error: QueueError) -> QueueError {
        let known = self.known();
        match (&error, &known.forbidden) {
            (QueueError::Away(_), Some((at, text))) if *at >= begun => {
                QueueError::Refused(format!(
                    "NATS at {} forbids it ({text}): give this machine's user the permissions of \
                     its role",
                    self.servers
                ))
            }
            _ => error,
        }
    }
}
