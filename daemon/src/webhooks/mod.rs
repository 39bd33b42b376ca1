//! Webhooks: messages to other programs when something is done.
//!
//! ```text
//! a scan's or job's record --one transaction--> message that waits --> thread of the webhook
//!                                                      ^                       |
//!                                                      '-- tried again later --+--> log
//! ```
//!
//! A message is on disk before it is tried, so that it is delivered at least once, whatever
//! becomes of the service meanwhile. Each webhook has a thread of its own, which alone waits for
//! its receiver.

mod backoff;
mod deliver;
mod receiver;
mod secret;
mod shown;
mod tell;
mod words;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::config::WebhookConfig;
use crate::service::{Service, lock};
use crate::store::{Added, Store, StoreError};
use receiver::Receiver;
pub(crate) use shown::shown_url;
use words::warn_without_network;

/// How long the end of the service waits for an attempt that is under way. Its message is tried
/// again after the next start.
const FAREWELL: Duration = Duration::from_secs(3);

/// A file that a webhook names cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct FileError {
    /// The key that names it.
    key: &'static str,
    message: String,
}

impl FileError {
    pub(crate) fn key(&self) -> &'static str {
        self.key
    }
}

/// Looks at the files that a webhook names.
pub(crate) fn check_files(config: &WebhookConfig) -> Result<(), FileError> {
    Receiver::read_files(config).map(drop)
}

/// The webhooks cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum WebhookError {
    /// A file does not work.
    #[error("webhook {name}: {message}")]
    File {
        /// The webhook.
        name: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// The messages that wait cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The webhooks of the service.
#[derive(Debug, Default)]
pub(crate) struct Webhooks {
    /// In the order of the configuration.
    hooks: RwLock<Vec<Arc<Hook>>>,
}

/// A webhook.
pub(crate) struct Hook {
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
    /// The service ends, or the webhook is not configured any more.
    ended: bool,
    /// Its thread has ended.
    gone: bool,
}

impl fmt::Debug for Hook {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hook")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl Hook {
    fn new(receiver: Receiver) -> Self {
        Self {
            name: receiver.config.name.clone(),
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

    /// Waits for the message that is due next. None once the webhook has ended.
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

    /// Waits, and tells whether the webhook has ended.
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
                webhook = self.name,
                "the receiver has not answered yet: the message is tried again after the next start"
            );
            return;
        }
        drop(state);
        if thread.join().is_err() {
            tracing::error!(webhook = self.name, "a thread ended by a panic");
        }
    }
}

impl Webhooks {
    /// The webhooks as they are configured, with the messages that wait for them.
    pub(crate) fn open(configs: &[WebhookConfig], store: &Store) -> Result<Self, WebhookError> {
        let webhooks = Self::default();
        webhooks.replace(configs, store)?;
        if !configs.is_empty() {
            warn_without_network();
        }
        Ok(webhooks)
    }

    /// Takes over a configuration. What waits is tried at once: somebody may have mended what
    /// was wrong.
    fn replace(&self, configs: &[WebhookConfig], store: &Store) -> Result<(), WebhookError> {
        let mut receivers = Vec::new();
        for config in configs {
            let receiver = Receiver::new(config).map_err(|error| WebhookError::File {
                name: config.name.clone(),
                message: error.to_string(),
            })?;
            receivers.push(receiver);
        }
        let known: Vec<&str> = configs.iter().map(|config| config.name.as_str()).collect();
        let earlier = self.all();
        let mut hooks = Vec::new();
        for receiver in receivers {
            let same = earlier
                .iter()
                .find(|hook| hook.name == receiver.config.name);
            match same {
                Some(hook) => {
                    hook.change(|state| state.receiver = Arc::new(receiver));
                    hooks.push(Arc::clone(hook));
                }
                None => hooks.push(Arc::new(Hook::new(receiver))),
            }
        }
        // Before what waits is looked for, so that no message comes between the two.
        *self.hooks.write().unwrap_or_else(PoisonError::into_inner) = hooks;
        // Whatever the disk says next: nobody would find them again.
        for hook in earlier {
            if !known.contains(&hook.name.as_str()) {
                hook.change(|state| state.ended = true);
            }
        }
        for hook in self.all() {
            let numbers = store.waiting(&hook.name)?;
            let now = Instant::now();
            hook.change(|state| state.due.extend(numbers.into_iter().map(|n| (n, now))));
        }
        for (webhook, messages) in store.forget_other_webhooks(&known)? {
            tracing::warn!(
                webhook,
                messages,
                "messages are given up, since their webhook is not configured any more"
            );
        }
        Ok(())
    }

    fn all(&self) -> Vec<Arc<Hook>> {
        self.hooks
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Messages are on disk: their turn comes.
    pub(crate) fn added(&self, added: Vec<Added>) {
        let hooks = self.all();
        for added in added {
            let Some(hook) = hooks.iter().find(|hook| hook.name == added.webhook) else {
                continue;
            };
            hook.change(|state| {
                // One that was kept already may have to wait.
                state.due.entry(added.number).or_insert_with(Instant::now);
                for number in &added.dropped {
                    state.due.remove(number);
                    state.dropped += 1;
                    tracing::warn!(
                        webhook = hook.name,
                        dropped = state.dropped,
                        "the oldest message had to make room: too many wait for the receiver"
                    );
                }
            });
        }
    }

    /// No attempt is begun any more.
    pub(crate) fn stop(&self) {
        for hook in self.all() {
            hook.change(|state| state.ended = true);
        }
    }

    /// Waits for the end of all threads, unless that takes too long.
    pub(crate) fn join(&self) {
        let until = Instant::now() + FAREWELL;
        for hook in self.all() {
            hook.join(until);
        }
    }
}

/// Gives each webhook that has none its thread.
pub(crate) fn begin_all(service: &Arc<Service>) -> std::io::Result<()> {
    for hook in service.webhooks.all() {
        let mut thread = lock(&hook.thread);
        if thread.is_none() {
            let (service, hook) = (Arc::clone(service), Arc::clone(&hook));
            let begun = std::thread::Builder::new()
                .name(format!("webhook {}", hook.name))
                .spawn(move || deliver::deliver(&service, &hook))?;
            *thread = Some(begun);
        }
    }
    Ok(())
}

/// Takes over a configuration that has been read again.
pub(crate) fn reload(service: &Arc<Service>, configs: &[WebhookConfig]) {
    if let Err(error) = service.webhooks.replace(configs, &service.store) {
        tracing::error!(%error, "cannot take over the webhooks");
    }
    if let Err(error) = begin_all(service) {
        tracing::error!(%error, "cannot start a thread: a webhook waits for the next reload");
    }
}
