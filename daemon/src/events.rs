//! Telling subscribers what happens, without ever waiting for one.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex};

use relief_api::Event;
use tokio::sync::watch;

use crate::service::lock;

/// Bytes a subscriber may be behind before it loses the oldest events: some ten seconds
/// of a fast scan of long columns. All subscribers share these bytes.
const BACKLOG_BYTES: usize = 8 << 20;
/// What an event takes beside its text.
const OVERHEAD_BYTES: usize = 128;
/// Events that there is room for while there is none.
const EMPTY_CAPACITY: usize = 64;

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

/// What has been told lately and somebody has still to hear.
#[derive(Debug, Default)]
struct Backlog {
    events: VecDeque<Arc<Told>>,
    bytes: usize,
    /// Number of the first of these events, counted from the start of the service.
    first: u64,
    /// Number of the event that each subscriber is to hear next.
    places: BTreeMap<u64, u64>,
    /// The name of the next subscriber in `places`.
    newcomer: u64,
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
            self.pop();
        }
    }

    fn pop(&mut self) {
        if let Some(oldest) = self.events.pop_front() {
            self.bytes -= oldest.bytes();
            self.first += 1;
        }
    }

    /// Lets go what all have heard; what nobody listens to is heard by all.
    fn trim(&mut self) {
        let next = self.next();
        let heard = self.places.values().min().copied().unwrap_or(next);
        while self.first < heard.min(next) {
            self.pop();
        }
        if self.events.is_empty() {
            // Not to hold for good the room that one burst has taken.
            self.events.shrink_to(EMPTY_CAPACITY);
        }
    }

    fn get(&self, number: u64) -> Option<Arc<Told>> {
        let index = usize::try_from(number.checked_sub(self.first)?).ok()?;
        self.events.get(index).cloned()
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
            return;
        }
        let told = Told::new(&event);
        let next = {
            let mut backlog = lock(&self.backlog);
            // The last one may just have gone.
            if backlog.places.is_empty() {
                return;
            }
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
        // In this order: what is told once there is a place wakes it.
        let wake = self.wake.subscribe();
        let mut backlog = lock(&self.backlog);
        let (name, next) = (backlog.newcomer, backlog.next());
        backlog.newcomer += 1;
        backlog.places.insert(name, next);
        Subscriber {
            name,
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
    /// In the backlog's places.
    name: u64,
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
        let mut backlog = lock(&self.backlog);
        let next = backlog.places.get(&self.name).copied()?;
        if next < backlog.first {
            let (first, missed) = (backlog.first, backlog.first - next);
            backlog.places.insert(self.name, first);
            return Some(Heard::Lagged(missed));
        }
        let told = backlog.get(next)?;
        backlog.places.insert(self.name, next + 1);
        backlog.trim();
        Some(Heard::Event(told))
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        let mut backlog = lock(&self.backlog);
        backlog.places.remove(&self.name);
        backlog.trim();
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
        hub.tell(event(1_001, 10));
        assert_ne!(lock(&hub.backlog).bytes, 0);
        drop(slow);
        assert_eq!(lock(&hub.backlog).bytes, 0);
        hub.tell(event(1_001, 10));
        assert_eq!(lock(&hub.backlog).bytes, 0);
        let mut late = hub.subscribe();
        hub.tell(event(1_002, 10));
        let heard = Told::new(&event(1_002, 10));
        assert_eq!(late.next().await, Some(Heard::Event(Arc::new(heard))));
    }

    #[tokio::test]
    async fn what_all_have_heard_is_let_go() {
        let hub = Hub::with_limit(1_000_000);
        let (mut quick, mut slow) = (hub.subscribe(), hub.subscribe());
        for number in 0..3 {
            hub.tell(event(number, 10));
        }
        let kept = || lock(&hub.backlog).events.len();
        for _ in 0..3 {
            quick.next().await.unwrap();
        }
        assert_eq!(kept(), 3);
        for heard in 1..=3 {
            slow.next().await.unwrap();
            assert_eq!(kept(), 3 - heard);
        }
        assert_eq!(lock(&hub.backlog).bytes, 0);
    }
}
