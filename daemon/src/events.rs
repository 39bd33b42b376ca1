//! Telling subscribers what happens, without ever waiting for one.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use relief_api::Event;
use tokio::sync::watch;

use crate::service::lock;

/// Bytes a subscriber may be behind before it loses the oldest events: some ten seconds
/// of a fast scan of long columns. All subscribers share these bytes.
const BACKLOG_BYTES: usize = 8 << 20;
/// What an event takes beside its text.
const OVERHEAD_BYTES: usize = 128;

/// An event as it is sent: put into words once, however many listen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Told {
    pub(crate) kind: &'static str,
    pub(crate) json: String,
}

impl Told {
    pub(crate) fn new(event: &Event) -> Self {
        Self {
            kind: event.kind(),
            // Events serialise whatever they hold.
            json: serde_json::to_string(event).unwrap_or_default(),
        }
    }

    fn bytes(&self) -> usize {
        self.json.len() + OVERHEAD_BYTES
    }
}

/// What has been told lately.
#[derive(Debug, Default)]
struct Backlog {
    events: VecDeque<Arc<Told>>,
    bytes: usize,
    /// Number of the first of these events, counted from the start of the service.
    first: u64,
}

impl Backlog {
    /// Number that the next event will have.
    fn next(&self) -> u64 {
        self.first + self.events.len() as u64
    }

    fn push(&mut self, told: Told, limit_bytes: usize) {
        self.bytes += told.bytes();
        self.events.push_back(Arc::new(told));
        // The newest stays, whatever its size.
        while self.bytes > limit_bytes && self.events.len() > 1 {
            if let Some(oldest) = self.events.pop_front() {
                self.bytes -= oldest.bytes();
                self.first += 1;
            }
        }
    }

    fn get(&self, number: u64) -> Option<Arc<Told>> {
        let index = usize::try_from(number.checked_sub(self.first)?).ok()?;
        self.events.get(index).cloned()
    }

    /// Nobody listens any more.
    fn clear(&mut self) {
        self.first = self.next();
        self.events.clear();
        self.bytes = 0;
    }
}

/// Where events are told.
#[derive(Debug)]
pub(crate) struct Hub {
    backlog: Arc<Mutex<Backlog>>,
    /// Number of the next event; a change of it wakes the subscribers.
    wake: watch::Sender<u64>,
    limit_bytes: usize,
}

impl Default for Hub {
    fn default() -> Self {
        Self::with_limit(BACKLOG_BYTES)
    }
}

impl Hub {
    fn with_limit(limit_bytes: usize) -> Self {
        Self {
            backlog: Arc::default(),
            wake: watch::Sender::new(0),
            limit_bytes,
        }
    }

    /// Tells all subscribers; returns at once.
    pub(crate) fn tell(&self, event: Event) {
        if !self.has_listeners() {
            lock(&self.backlog).clear();
            return;
        }
        let told = Told::new(&event);
        let next = {
            let mut backlog = lock(&self.backlog);
            backlog.push(told, self.limit_bytes);
            backlog.next()
        };
        self.wake.send_replace(next);
    }

    /// True when it is worth making an event that costs something.
    pub(crate) fn has_listeners(&self) -> bool {
        self.wake.receiver_count() > 0
    }

    /// Hears everything told from now on.
    pub(crate) fn subscribe(&self) -> Subscriber {
        // In this order: what is told in between is heard.
        let wake = self.wake.subscribe();
        Subscriber {
            next: lock(&self.backlog).next(),
            backlog: Arc::clone(&self.backlog),
            wake,
        }
    }
}

/// What a subscriber hears next.
#[derive(Debug, PartialEq)]
pub(crate) enum Heard {
    /// The next event.
    Event(Arc<Told>),
    /// So many events were lost, since it was too slow.
    Lagged(u64),
}

/// One subscriber's place in what is told.
#[derive(Debug)]
pub(crate) struct Subscriber {
    backlog: Arc<Mutex<Backlog>>,
    wake: watch::Receiver<u64>,
    /// Number of the event to hear next.
    next: u64,
}

impl Subscriber {
    /// The next event; waits for one. `None` when no more can come.
    pub(crate) async fn next(&mut self) -> Option<Heard> {
        loop {
            // Before looking, so that what is told after the look wakes.
            self.wake.mark_unchanged();
            if let Some(heard) = self.look() {
                return Some(heard);
            }
            self.wake.changed().await.ok()?;
        }
    }

    fn look(&mut self) -> Option<Heard> {
        let backlog = lock(&self.backlog);
        if self.next < backlog.first {
            let missed = backlog.first - self.next;
            self.next = backlog.first;
            return Some(Heard::Lagged(missed));
        }
        let told = backlog.get(self.next)?;
        self.next += 1;
        Some(Heard::Event(told))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An event of about this many bytes.
    fn event(number: u64, bytes: usize) -> Event {
        Event::Progress {
            job: number,
            scan: "x".repeat(bytes),
            scanner: String::new(),
            stage: String::new(),
            fraction: 0.0,
            seconds: None,
        }
    }

    #[tokio::test]
    async fn subscribers_hear_everything_told_since_they_came() {
        let hub = Hub::with_limit(1_000_000);
        hub.tell(event(1, 10));
        let mut early = hub.subscribe();
        hub.tell(event(2, 10));
        let mut late = hub.subscribe();
        hub.tell(event(3, 10));
        let heard = |number| Some(Heard::Event(Arc::new(Told::new(&event(number, 10)))));
        assert_eq!(early.next().await, heard(2));
        assert_eq!(early.next().await, heard(3));
        assert_eq!(late.next().await, heard(3));
        let (next, ()) = tokio::join!(early.next(), async { hub.tell(event(4, 10)) });
        assert_eq!(next, heard(4));
        drop(hub);
        assert_eq!(late.next().await, heard(4));
        assert_eq!(late.next().await, None);
    }

    #[tokio::test]
    async fn the_backlog_is_bounded_in_bytes_and_losses_are_told() {
        let hub = Hub::with_limit(100_000);
        let mut slow = hub.subscribe();
        for number in 0..1_000 {
            hub.tell(event(number, 10_000));
            assert!(lock(&hub.backlog).bytes <= 100_000);
        }
        let Some(Heard::Lagged(missed)) = slow.next().await else {
            panic!("nothing was lost");
        };
        assert_eq!(missed, 1_000 - lock(&hub.backlog).events.len() as u64);
        let first = Told::new(&event(missed, 10_000));
        assert_eq!(slow.next().await, Some(Heard::Event(Arc::new(first))));
        // One that is larger than all is still heard.
        hub.tell(event(1_000, 200_000));
        assert!(matches!(slow.next().await, Some(Heard::Lagged(_))));
        let last = Told::new(&event(1_000, 200_000));
        assert_eq!(slow.next().await, Some(Heard::Event(Arc::new(last))));
        // Nothing is kept for nobody.
        drop(slow);
        hub.tell(event(1_001, 10));
        assert_eq!(lock(&hub.backlog).bytes, 0);
        let mut late = hub.subscribe();
        hub.tell(event(1_002, 10));
        let heard = Told::new(&event(1_002, 10));
        assert_eq!(late.next().await, Some(Heard::Event(Arc::new(heard))));
    }
}
