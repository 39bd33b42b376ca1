//! Receivers of messages: who is told when something is done, and how.
//!
//! ```text
//! a scan's or job's record --one transaction--> message that waits --> thread of the receiver
//!                                                      ^                       |
//!                                                      '-- tried again later --+--> log
//! ```
//!
//! A message is on disk before it is tried, so that it is delivered at least once, whatever
//! becomes of the service meanwhile. Each receiver has a thread of its own, which alone waits for
//! it.
//!
//! What keeps, tries again, logs and tests messages knows no kind of receiver. A kind is a
//! [`receiver::Way`] in a module of its own, which [`make_all`] makes of its sections of the
//! configuration.

mod agent;
mod backoff;
mod deliver;
mod files;
mod hook;
mod mail;
mod mqtt;
mod receiver;
mod run;
mod runs;
mod show;
mod tell;
mod upload;
mod webhook;
mod words;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use relief_api::WebhookKind;

use crate::config::{Config, UploadConfig, UploadTo};
use crate::service::{Service, lock};
use crate::store::{Added, Store, StoreError};
pub(crate) use agent::agent;
pub(crate) use files::{FileError, authorities_in, certificates_in, read_secret};
pub(crate) use hook::check_command;
pub(crate) use mail::check_files as check_mail_files;
pub(crate) use mqtt::check_files as check_broker_files;
use receiver::Receiver;
pub(crate) use show::show;
pub(crate) use upload::check_files as check_upload_files;
pub(crate) use webhook::{check_files, shown_url};
pub(crate) use words::host_name;
use words::warn_without_network;

/// How long the end of the service waits for an attempt that is under way. Its message is tried
/// again after the next start.
const FAREWELL: Duration = Duration::from_secs(3);

/// Those who are told cannot be.
#[derive(Debug, thiserror::Error)]
pub enum ReceiverError {
    /// A file does not work.
    #[error("{} {name}: {message}", .kind.as_str())]
    File {
        /// What the receiver is.
        kind: WebhookKind,
        /// The receiver.
        name: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// The messages that wait cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Whether something is done with each result, in place of being told.
fn is_for_results(kind: WebhookKind) -> bool {
    matches!(kind, WebhookKind::Hook | WebhookKind::Upload)
}

/// Makes the receivers of a configuration, in its order.
fn make_all(config: &Config) -> Result<Vec<Receiver>, ReceiverError> {
    let mut made = Vec::new();
    for config in &config.webhooks {
        let receiver = webhook::receiver(config);
        made.push(receiver.map_err(failed(WebhookKind::Webhook, &config.name))?);
    }
    for config in &config.mqtt {
        let receiver = mqtt::receiver(config);
        made.push(receiver.map_err(failed(WebhookKind::Mqtt, &config.name))?);
    }
    let public_url = config.service.public_url.as_deref();
    for config in &config.mail {
        let receiver = mail::receiver(config, public_url);
        made.push(receiver.map_err(failed(WebhookKind::Mail, &config.name))?);
    }
    // Programs are run in folders of their own, where a relative path would lead elsewhere.
    let state_dir = &config.service.state_dir;
    let state_dir = &std::path::absolute(state_dir).unwrap_or_else(|_| state_dir.clone());
    made.extend(
        config
            .hooks
            .iter()
            .map(|own| hook::receiver(own, state_dir)),
    );
    for config in &config.uploads {
        let receiver = upload::receiver(config, state_dir);
        made.push(receiver.map_err(failed(WebhookKind::Upload, &config.name))?);
    }
    Ok(made)
}

/// Says whose file it is that does not work.
fn failed(kind: WebhookKind, name: &str) -> impl FnOnce(FileError) -> ReceiverError {
    let name = name.to_owned();
    move |error| ReceiverError::File {
        kind,
        name,
        message: error.to_string(),
    }
}

/// All who are told.
#[derive(Debug, Default)]
pub(crate) struct Receivers {
    /// In the order of the configuration.
    outboxes: RwLock<Vec<Arc<Outbox>>>,
}

/// What waits for a receiver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Backlog {
    /// The receiver.
    pub(crate) name: String,
    pub(crate) waiting: u64,
    pub(crate) dropped: u64,
}

/// A receiver, and what waits for it.
pub(crate) struct Outbox {
    name: String,
    state: Mutex<State>,
    changed: Condvar,
    /// Held while somebody waits for the answer to a test.
    testing: Mutex<()>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

#[derive(Debug)]
struct State {
    receiver: Arc<Receiver>,
    /// When each message that waits is due.
    due: BTreeMap<u64, Instant>,
    /// Messages that had to make room since the service started.
    dropped: u64,
    /// The service ends, or the receiver is not configured any more.
    ended: bool,
    /// Its thread has ended.
    gone: bool,
}

impl fmt::Debug for Outbox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outbox")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl Outbox {
    fn new(receiver: Receiver) -> Self {
        Self {
            name: receiver.settings.name.clone(),
            state: Mutex::new(State {
                receiver: Arc::new(receiver),
                due: BTreeMap::new(),
                dropped: 0,
                ended: false,
                gone: false,
            }),
            changed: Condvar::new(),
            testing: Mutex::default(),
            thread: Mutex::default(),
        }
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut lock(&self.state));
        self.changed.notify_all();
    }

    fn receiver(&self) -> Arc<Receiver> {
        Arc::clone(&lock(&self.state).receiver)
    }

    /// Waits for the message that is due next. None once the receiver has ended.
    fn next(&self) -> Option<u64> {
        let mut state = lock(&self.state);
        loop {
            if state.ended {
                return None;
            }
            let now = Instant::now();
            // Of those that are due at once, the oldest.
            let next = state.due.iter().min_by_key(|(_, due)| **due);
            state = match next.map(|(number, due)| (*number, *due)) {
                Some((number, due)) if due <= now => return Some(number),
                Some((_, due)) => {
                    let waited = self.changed.wait_timeout(state, due - now);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self
                    .changed
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    /// Waits, and tells whether the receiver has ended.
    fn wait_for_end(&self, longest: Duration) -> bool {
        let state = lock(&self.state);
        self.wait_while(state, longest, |state| !state.ended).ended
    }

    fn wait_while<'a>(
        &'a self,
        state: MutexGuard<'a, State>,
        longest: Duration,
        condition: impl FnMut(&mut State) -> bool,
    ) -> MutexGuard<'a, State> {
        self.changed
            .wait_timeout_while(state, longest, condition)
            .unwrap_or_else(PoisonError::into_inner)
            .0
    }

    /// Waits for the end of the thread, but not beyond this time.
    fn join(&self, until: Instant) {
        let Some(thread) = lock(&self.thread).take() else {
            return;
        };
        let longest = until.saturating_duration_since(Instant::now());
        let state = self.wait_while(lock(&self.state), longest, |state| !state.gone);
        if !state.gone {
            tracing::warn!(
                receiver = self.name,
                "the receiver has not answered yet: the message is tried again after the next start"
            );
            return;
        }
        drop(state);
        if thread.join().is_err() {
            tracing::error!(receiver = self.name, "a thread ended by a panic");
        }
    }
}

impl Receivers {
    /// The receivers as they are configured, with the messages that wait for them.
    pub(crate) fn open(config: &Config, store: &Store) -> Result<Self, ReceiverError> {
        let receivers = Self::default();
        receivers.replace(config, store)?;
        let is_told = |outbox: &Arc<Outbox>| !is_for_results(outbox.receiver().settings.kind);
        let is_far = |upload: &UploadConfig| upload.to != UploadTo::Folder;
        if receivers.all().iter().any(is_told) || config.uploads.iter().any(is_far) {
            warn_without_network();
        }
        Ok(receivers)
    }

    /// Takes over a configuration. What waits is tried at once: somebody may have mended what
    /// was wrong.
    fn replace(&self, config: &Config, store: &Store) -> Result<(), ReceiverError> {
        let receivers = make_all(config)?;
        let known: Vec<String> = receivers
            .iter()
            .map(|receiver| receiver.settings.name.clone())
            .collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let earlier = self.all();
        let mut outboxes = Vec::new();
        // Given up at the end, and not while others wait: a connection may have to be ended.
        let mut replaced = Vec::new();
        for receiver in receivers {
            let same = earlier
                .iter()
                .find(|outbox| outbox.name == receiver.settings.name);
            match same {
                Some(outbox) => {
                    let receiver = Arc::new(receiver);
                    outbox.change(|state| {
                        replaced.push(std::mem::replace(&mut state.receiver, receiver));
                    });
                    outboxes.push(Arc::clone(outbox));
                }
                None => outboxes.push(Arc::new(Outbox::new(receiver))),
            }
        }
        // Before what waits is looked for, so that no message comes between the two.
        *self
            .outboxes
            .write()
            .unwrap_or_else(PoisonError::into_inner) = outboxes;
        // Whatever the disk says next: nobody would find them again.
        for outbox in earlier {
            if !known.contains(&outbox.name.as_str()) {
                outbox.change(|state| state.ended = true);
            }
        }
        for outbox in self.all() {
            let numbers = store.waiting(&outbox.name)?;
            let now = Instant::now();
            outbox.change(|state| state.due.extend(numbers.into_iter().map(|n| (n, now))));
        }
        for (receiver, messages) in store.forget_other_receivers(&known)? {
            tracing::warn!(
                receiver,
                messages,
                "messages are given up, since their receiver is not configured any more"
            );
        }
        Ok(())
    }

    /// What waits for each receiver of any kind, hooks and uploads among them, and what had to make
    /// room since the service started.
    pub(crate) fn backlogs(&self) -> Vec<Backlog> {
        let of = |outbox: &Arc<Outbox>| {
            let state = lock(&outbox.state);
            Backlog {
                name: outbox.name.clone(),
                waiting: state.due.len() as u64,
                dropped: state.dropped,
            }
        };
        self.all().iter().map(of).collect()
    }

    fn all(&self) -> Vec<Arc<Outbox>> {
        self.outboxes
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Messages are on disk: their turn comes.
    pub(crate) fn added(&self, added: Vec<Added>) {
        let outboxes = self.all();
        for added in added {
            let Some(outbox) = outboxes.iter().find(|outbox| outbox.name == added.receiver) else {
                continue;
            };
            outbox.change(|state| {
                // One that was kept already may have to wait.
                state.due.entry(added.number).or_insert_with(Instant::now);
                for number in &added.dropped {
                    state.due.remove(number);
                    state.dropped += 1;
                    tracing::warn!(
                        receiver = outbox.name,
                        dropped = state.dropped,
                        "the oldest message had to make room: too many wait for the receiver"
                    );
                }
            });
        }
    }

    /// No attempt is begun any more.
    pub(crate) fn stop(&self) {
        for outbox in self.all() {
            outbox.change(|state| state.ended = true);
        }
    }

    /// Waits for the end of all threads, unless that takes too long.
    pub(crate) fn join(&self) {
        let until = Instant::now() + FAREWELL;
        for outbox in self.all() {
            outbox.join(until);
        }
        // Only now: the last message may be under way until then.
        std::thread::scope(|scope| {
            for outbox in self.all() {
                scope.spawn(move || outbox.receiver().close());
            }
        });
    }
}

/// Of a receiver's thread, and of its pulse.
fn thread_name(outbox: &Outbox) -> String {
    format!(
        "{} {}",
        outbox.receiver().settings.kind.as_str(),
        outbox.name
    )
}

/// Gives each receiver that has none its thread.
pub(crate) fn begin_all(service: &Arc<Service>) -> std::io::Result<()> {
    for outbox in service.receivers.all() {
        let mut thread = lock(&outbox.thread);
        if thread.is_none() {
            let (service, outbox) = (Arc::clone(service), Arc::clone(&outbox));
            let begun = std::thread::Builder::new()
                .name(thread_name(&outbox))
                .spawn(move || deliver::deliver(&service, &outbox))?;
            *thread = Some(begun);
        }
    }
    Ok(())
}

/// Takes over a configuration that has been read again.
pub(crate) fn reload(service: &Arc<Service>, config: &Config) {
    if let Err(error) = service.receivers.replace(config, &service.store) {
        tracing::error!(%error, "cannot take over who is told");
    }
    if let Err(error) = begin_all(service) {
        tracing::error!(%error, "cannot start a thread: a receiver waits for the next reload");
    }
}
