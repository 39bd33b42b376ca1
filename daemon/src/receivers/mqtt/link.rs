//! The connection to a broker: made again whenever it is lost, by a thread of its own.
//!
//! Each connection begins with an empty session: whatever was not acknowledged on the one before is
//! tried again by whoever keeps the messages.

use std::any::Any;
use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rumqttc::{AsyncClient, Event, EventLoop, MqttOptions, NetworkOptions, Outgoing, Packet, QoS};
use tokio::sync::Notify;

use super::words;
use crate::error::panic_text;
use crate::service::lock;

/// Publications that wait to be written; more are refused.
const MOST_QUEUED: usize = 64;
/// How long to wait before another connection is tried, unless somebody has something to publish.
const FIRST_WAIT: Duration = Duration::from_secs(1);
const LONGEST_WAIT: Duration = Duration::from_secs(30);
/// How long the broker may take to hear that the service ends.
const FAREWELL: Duration = Duration::from_secs(1);

/// What is published.
#[derive(Debug, Clone)]
pub(super) struct Publication {
    pub(super) topic: String,
    pub(super) payload: String,
    /// The broker keeps it for whoever asks later.
    pub(super) retain: bool,
}

/// A connection to a broker.
pub(super) struct Link {
    shared: Arc<Shared>,
}

struct Shared {
    options: MqttOptions,
    timeout: Duration,
    /// Published when a connection is there, and before it ends.
    greetings: [Publication; 2],
    state: Mutex<State>,
    changed: Condvar,
    /// Wakes a connection that is just being made.
    end: Notify,
}

#[derive(Default)]
struct State {
    /// While there is a connection.
    client: Option<AsyncClient>,
    /// Counts connections.
    connection: u64,
    /// Why there is none.
    why_not: Option<String>,
    /// Somebody waits for one.
    wanted: bool,
    /// Publications that were handed over and not written yet, in order: their numbers.
    queued: VecDeque<u64>,
    /// Those that were written, by the packet's number.
    written: BTreeMap<u16, u64>,
    /// Those that somebody waits for, and whether the broker has acknowledged them.
    awaited: BTreeMap<u64, bool>,
    numbers: u64,
    ended: bool,
    gone: bool,
}

impl State {
    /// Hands a publication over. Gives its number.
    fn hand_over(&mut self, publication: Publication) -> Result<u64, String> {
        let Some(client) = &self.client else {
            return Err("there is no connection".into());
        };
        let Publication {
            topic,
            payload,
            retain,
        } = publication;
        client
            .try_publish(topic, QoS::AtLeastOnce, retain, payload)
            .map_err(|_| "too much waits to be sent to the broker".to_owned())?;
        self.numbers += 1;
        self.queued.push_back(self.numbers);
        Ok(self.numbers)
    }
}

impl Link {
    /// Begins to keep a connection.
    pub(super) fn begin(
        name: &str,
        options: MqttOptions,
        timeout: Duration,
        greetings: [Publication; 2],
    ) -> Self {
        let shared = Arc::new(Shared {
            options,
            timeout,
            greetings,
            state: Mutex::default(),
            changed: Condvar::new(),
            end: Notify::new(),
        });
        let thread = std::thread::Builder::new().name(format!("broker {name}"));
        let begun = thread.spawn({
            let shared = Arc::clone(&shared);
            move || shared.keep()
        });
        if let Err(error) = begun {
            shared.change(|state| {
                state.why_not = Some(format!("cannot start a thread: {error}"));
                state.gone = true;
            });
        }
        Self { shared }
    }

    /// Publishes, and waits until the broker has acknowledged it.
    pub(super) fn publish(&self, publication: Publication) -> Result<(), String> {
        let shared = &*self.shared;
        let until = Instant::now() + shared.timeout;
        let mut state = lock(&shared.state);
        state.wanted = true;
        shared.changed.notify_all();
        let before = state.why_not.take();
        // Until there is a connection, or another attempt has failed.
        let longest = until.saturating_duration_since(Instant::now());
        state = shared.wait_while(state, longest, |state| {
            state.client.is_none() && state.why_not.is_none() && !state.ended
        });
        if state.client.is_none() {
            let why = state.why_not.clone().or(before.clone());
            state.why_not = why.clone();
            return Err(why.unwrap_or_else(|| shared.silent()));
        }
        let number = state.hand_over(publication)?;
        let connection = state.connection;
        state.awaited.insert(number, false);
        let longest = until.saturating_duration_since(Instant::now());
        state = shared.wait_while(state, longest, |state| {
            state.connection == connection
                && state.client.is_some()
                && state.awaited.get(&number) == Some(&false)
        });
        match state.awaited.remove(&number) {
            Some(true) => Ok(()),
            _ if state.client.is_some() && state.connection == connection => Err(shared.silent()),
            _ => Err(state
                .why_not
                .clone()
                .unwrap_or_else(|| "the connection to the broker was lost".into())),
        }
    }

    /// Publishes without waiting, if there is a connection. Gives whether there was.
    pub(super) fn show(&self, publication: Publication) -> bool {
        lock(&self.shared.state).hand_over(publication).is_ok()
    }

    /// The number of the connection, if there is one.
    pub(super) fn connection(&self) -> Option<u64> {
        let state = lock(&self.shared.state);
        state.client.as_ref().map(|_| state.connection)
    }

    /// Says farewell, and waits for a moment until that is said.
    pub(super) fn close(&self) {
        let shared = &*self.shared;
        let mut state = lock(&shared.state);
        if !state.ended {
            state.ended = true;
            let [_, farewell] = &shared.greetings;
            // Whoever listens is told by the last will otherwise.
            if state.hand_over(farewell.clone()).is_ok()
                && let Some(client) = &state.client
            {
                let _ = client.try_disconnect();
            }
            shared.end.notify_one();
            shared.changed.notify_all();
        }
        drop(shared.wait_while(state, FAREWELL, |state| !state.gone));
    }
}

impl Shared {
    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut lock(&self.state));
        self.changed.notify_all();
    }

    fn wait_while<'a>(
        &'a self,
        state: std::sync::MutexGuard<'a, State>,
        longest: Duration,
        condition: impl FnMut(&mut State) -> bool,
    ) -> std::sync::MutexGuard<'a, State> {
        self.changed
            .wait_timeout_while(state, longest, condition)
            .unwrap_or_else(PoisonError::into_inner)
            .0
    }

    fn broker(&self) -> String {
        let (host, port) = self.options.broker_address();
        format!("{host}:{port}")
    }

    fn silent(&self) -> String {
        format!(
            "{} did not answer within {} ms (timeout_ms)",
            self.broker(),
            self.timeout.as_millis()
        )
    }

    /// Keeps a connection until the end. Runs on a thread of its own.
    fn keep(&self) {
        let mut wait = FIRST_WAIT;
        let mut told: Option<String> = None;
        loop {
            let begun = Instant::now();
            // A defect that a broker sets off costs one connection and nothing else.
            let ended = catch_unwind(AssertUnwindSafe(|| self.connect()));
            let why = ended.unwrap_or_else(|panic| Some(defect(&*panic)));
            let mut state = lock(&self.state);
            if state.client.take().is_some() {
                // One that is lost at once each time, as where two services have one name there, is
                // not made again each second.
                if begun.elapsed() >= LONGEST_WAIT {
                    wait = FIRST_WAIT;
                }
                if let Some(why) = &why {
                    tracing::warn!(broker = self.broker(), %why, "connection to a broker lost");
                }
            } else if let Some(why) = &why
                && told.as_ref() != Some(why)
            {
                // Once, for as long as it stays the same.
                tracing::warn!(broker = self.broker(), %why, "no connection to a broker");
            }
            told.clone_from(&why);
            state.queued.clear();
            state.written.clear();
            state.why_not = why;
            state.wanted = false;
            self.changed.notify_all();
            state = self.wait_while(state, wait, |state| !state.wanted && !state.ended);
            if state.ended {
                state.gone = true;
                drop(state);
                self.changed.notify_all();
                return;
            }
            wait = (2 * wait).min(LONGEST_WAIT);
        }
    }

    /// One connection, from its beginning to its end. Gives why it ended, unless it was to.
    fn connect(&self) -> Option<String> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = match runtime {
            Ok(runtime) => runtime,
            Err(error) => return Some(format!("cannot begin a connection: {error}")),
        };
        let (client, mut events) = AsyncClient::new(self.options.clone(), MOST_QUEUED);
        let mut network = NetworkOptions::new();
        network.set_connection_timeout(self.timeout.as_secs().max(1));
        events.set_network_options(network);
        let why = runtime.block_on(self.follow(client, &mut events));
        // A name server that does not answer keeps a thread, which is not waited for.
        runtime.shutdown_background();
        why
    }

    async fn follow(&self, client: AsyncClient, events: &mut EventLoop) -> Option<String> {
        let mut client = Some(client);
        loop {
            let event = tokio::select! {
                event = events.poll() => event,
                // Once there is a connection, the farewell ends it.
                () = self.end.notified(), if client.is_some() => return None,
            };
            match event {
                Ok(Event::Incoming(Packet::ConnAck(_))) => self.change(|state| {
                    state.client = client.take();
                    state.connection += 1;
                    state.why_not = None;
                    let [greeting, _] = &self.greetings;
                    // It is the first, so that there is room for it.
                    let _ = state.hand_over(greeting.clone());
                    tracing::info!(broker = self.broker(), "connected to a broker");
                }),
                Ok(Event::Outgoing(Outgoing::Publish(packet))) => self.change(|state| {
                    if let Some(number) = state.queued.pop_front() {
                        state.written.insert(packet, number);
                    }
                }),
                Ok(Event::Incoming(Packet::PubAck(acknowledged))) => self.change(|state| {
                    let number = state.written.remove(&acknowledged.pkid);
                    if let Some(taken) = number.and_then(|number| state.awaited.get_mut(&number)) {
                        *taken = true;
                    }
                }),
                Ok(Event::Outgoing(Outgoing::Disconnect)) => return None,
                Ok(_) => {}
                Err(error) => return Some(words::told(&error, &self.broker(), self.timeout)),
            }
        }
    }
}

fn defect(panic: &(dyn Any + Send)) -> String {
    format!(
        "the connection ended unexpectedly: {}; this is a defect of the program: please report it",
        panic_text(panic)
    )
}
