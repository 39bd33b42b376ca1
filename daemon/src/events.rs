//! Telling subscribers what happens, without ever waiting for one.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::str::FromStr;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use relief_api::Event;
use tokio::sync::watch;

use crate::service::lock;

/// Bytes a subscriber may be behind before it loses the oldest events: some ten seconds
/// of a fast scan of long columns. All subscribers share these bytes.
const BACKLOG_BYTES: usize = 8 << 20;
/// Bytes of events that all have heard and that are kept all the same, for those who come back
/// after their connection was lost.
const REMEMBERED_BYTES: usize = 2 << 20;
/// How long events are kept for somebody to come back to when nobody listens any more.
const REMEMBERED_FOR: Duration = Duration::from_secs(60);
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

/// A place in what is told: which event is heard next. Of another run of the service it means
/// nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct EventId {
    run: u64,
    next: u64,
}

impl fmt::Display for EventId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:x}-{}", self.run, self.next)
    }
}

impl FromStr for EventId {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (run, next) = text.split_once('-').ok_or(())?;
        Ok(Self {
            run: u64::from_str_radix(run, 16).map_err(drop)?,
            next: next.parse().map_err(drop)?,
        })
    }
}

/// What has been told lately and somebody has still to hear, or may come back for.
#[derive(Debug, Default)]
struct Backlog {
    /// Names this run of the service.
    run: u64,
    events: VecDeque<Arc<Told>>,
    bytes: usize,
    /// Number of the first of these events, counted from the start of the service.
    first: u64,
    /// Number of the event that each subscriber is to hear next.
    places: BTreeMap<u64, u64>,
    /// The name of the next subscriber in `places`.
    newcomer: u64,
    /// When the last subscriber went, if none is left.
    left_alone: Option<Instant>,
    limits: Limits,
}

/// How much is kept, and for how long.
#[derive(Debug, Clone, Copy, Default)]
struct Limits {
    backlog_bytes: usize,
    remembered_bytes: usize,
    remembered_for: Duration,
}

impl Backlog {
    /// Number that the next event will have.
    fn next(&self) -> u64 {
        self.first + self.events.len() as u64
    }

    fn push(&mut self, told: Told) {
        let limit_bytes = self.limits.backlog_bytes;
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

    /// Lets go what all have heard but for the latest; what nobody listens to is heard by all.
    fn trim(&mut self) {
        let next = self.next();
        let heard = self.places.values().min().copied().unwrap_or(next);
        while self.first < heard.min(next) && self.bytes > self.limits.remembered_bytes {
            self.pop();
        }
        if self.events.is_empty() {
            // Not to hold for good the room that one burst has taken.
            self.events.shrink_to(EMPTY_CAPACITY);
        }
    }

    /// Nobody listens, and nobody is waited for any more.
    fn is_forgotten(&self) -> bool {
        let alone = self
            .left_alone
            .is_none_or(|since| since.elapsed() >= self.limits.remembered_for);
        self.places.is_empty() && alone
    }

    /// Once nobody is waited for: from now on events go by that are not even made, so that places
    /// of before mean nothing any more.
    fn forget(&mut self) {
        self.first = self.next() + 1;
        self.events = VecDeque::new();
        self.bytes = 0;
        self.left_alone = None;
    }

    /// A place from which this event is heard next.
    fn enter(&mut self, next: u64) -> u64 {
        let name = self.newcomer;
        self.newcomer += 1;
        self.places.insert(name, next);
        self.left_alone = None;
        name
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
}

impl Default for Hub {
    fn default() -> Self {
        Self::with_limits(Limits {
            backlog_bytes: BACKLOG_BYTES,
            remembered_bytes: REMEMBERED_BYTES,
            remembered_for: REMEMBERED_FOR,
        })
    }
}

impl Hub {
    fn with_limits(limits: Limits) -> Self {
        // Two runs in one millisecond would need more luck than a clock that is set back.
        let run = jiff::Timestamp::now().as_millisecond().unsigned_abs();
        Self {
            backlog: Arc::new(Mutex::new(Backlog {
                run,
                limits,
                ..Backlog::default()
            })),
            wake: watch::Sender::new(0),
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
            if backlog.is_forgotten() {
                return;
            }
            backlog.push(told);
            backlog.trim();
            backlog.next()
        };
        self.wake.send_replace(next);
    }

    /// True when it is worth making an event that costs something: somebody listens, or may
    /// just have lost the connection.
    pub(crate) fn has_listeners(&self) -> bool {
        if self.wake.receiver_count() > 0 {
            return true;
        }
        let mut backlog = lock(&self.backlog);
        let forgotten = backlog.is_forgotten();
        if forgotten && backlog.left_alone.is_some() {
            backlog.forget();
        }
        !forgotten
    }

    /// Hears everything told from now on.
    pub(crate) fn subscribe(&self) -> Subscriber {
        // In this order: what is told once there is a place wakes it.
        let wake = self.wake.subscribe();
        let mut backlog = lock(&self.backlog);
        if backlog.is_forgotten() && backlog.left_alone.is_some() {
            backlog.forget();
        }
        let next = backlog.next();
        Subscriber {
            name: backlog.enter(next),
            backlog: Arc::clone(&self.backlog),
            wake,
        }
    }

    /// Hears everything told since then; `None` if not all of that is known any more.
    pub(crate) fn resume(&self, last: EventId) -> Option<Subscriber> {
        let wake = self.wake.subscribe();
        let mut backlog = lock(&self.backlog);
        let known = backlog.first..=backlog.next();
        // With nobody waited for, events have gone by that were not even made.
        if backlog.run != last.run || !known.contains(&last.next) || backlog.is_forgotten() {
            return None;
        }
        Some(Subscriber {
            name: backlog.enter(last.next),
            backlog: Arc::clone(&self.backlog),
            wake,
        })
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

    /// Where it stands: all before that has been heard.
    pub(crate) fn heard(&self) -> EventId {
        let backlog = lock(&self.backlog);
        EventId {
            run: backlog.run,
            next: backlog.places.get(&self.name).copied().unwrap_or_default(),
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
        if backlog.places.is_empty() {
            backlog.left_alone = Some(Instant::now());
        }
        backlog.trim();
    }
}

#[cfg(test)]
mod tests;
