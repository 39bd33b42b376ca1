//! Telling subscribers what happens, without ever waiting for one.

use std::sync::Arc;

use relief_api::Event;
use tokio::sync::broadcast;

/// Events a subscriber may be behind before it loses the oldest: some ten seconds of a
/// fast scan.
const BACKLOG: usize = 2_048;

/// Where events are told.
#[derive(Debug, Clone)]
pub(crate) struct Hub {
    sender: broadcast::Sender<Arc<Event>>,
}

impl Default for Hub {
    fn default() -> Self {
        Self {
            sender: broadcast::Sender::new(BACKLOG),
        }
    }
}

impl Hub {
    /// Tells all subscribers; returns at once.
    pub(crate) fn tell(&self, event: Event) {
        // An error means that nobody listens.
        let _ = self.sender.send(Arc::new(event));
    }

    /// True when it is worth making an event that costs something.
    pub(crate) fn has_listeners(&self) -> bool {
        self.sender.receiver_count() > 0
    }

    /// Hears everything told from now on.
    pub(crate) fn subscribe(&self) -> broadcast::Receiver<Arc<Event>> {
        self.sender.subscribe()
    }
}
