//! The control side: what a test does to a running device, and what it waits for.
//!
//! Tests wait for events, never for a while: [`Control::wait_for`] returns as soon as the
//! event is there, and its time limit only keeps a broken test from hanging.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use scanner_protocol::{Activity, Faults, ResetCause};
use thiserror::Error;

use crate::device::{Device, Event, Snapshot};

/// What the endpoint's thread and the controls share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) bench: Mutex<Running>,
    changed: Condvar,
    /// A byte written here wakes the endpoint's thread.
    waker: UnixStream,
    started: Instant,
}

#[derive(Debug)]
pub(crate) struct Running {
    pub(crate) device: Device,
    /// Nothing is taken in and nothing is sent.
    pub(crate) stalled: bool,
    /// Whether a host has the port open; unknown for endpoints without one.
    pub(crate) host_connected: Option<bool>,
    /// The plug is out.
    pub(crate) unplugged: bool,
    /// The endpoint to the host is to be halted once; for endpoints on USB.
    pub(crate) halt_endpoint: bool,
    pub(crate) ended: bool,
    line: LineUse,
    waiting: Option<Wait>,
}

/// What has gone over the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineUse {
    /// Bytes sent to the host.
    pub to_host_bytes: u64,
    /// Bytes received from the host.
    pub from_host_bytes: u64,
    /// How long the device could not go on since the host did not fetch what was sent, or
    /// had given no credit for more columns.
    pub waited_for_host: Duration,
    /// The part of it for which there was no credit.
    pub waited_for_credit: Duration,
}

/// Since when the device waits for the host.
#[derive(Debug, Clone, Copy)]
struct Wait {
    since: Duration,
    for_credit: bool,
}

impl LineUse {
    fn add(&mut self, wait: Wait, now: Duration) {
        let waited = now.saturating_sub(wait.since);
        self.waited_for_host += waited;
        if wait.for_credit {
            self.waited_for_credit += waited;
        }
    }
}

impl Running {
    /// Whether the plug is out, by a tester's hand or a mishap.
    pub(crate) fn is_unplugged(&self) -> bool {
        self.unplugged || self.device.is_unplugged()
    }

    pub(crate) fn note_to_host(&mut self, bytes: usize) {
        self.line.to_host_bytes += bytes as u64;
    }

    pub(crate) fn note_from_host(&mut self, bytes: usize) {
        self.line.from_host_bytes += bytes as u64;
    }

    /// Keeps the account of waiting; `unfetched` says that the line holds bytes for the host.
    pub(crate) fn note_line(&mut self, now: Duration, unfetched: bool) {
        if let Some(wait) = self.waiting.take() {
            self.line.add(wait, now);
        }
        let for_credit = self.device.snapshot(now).activity == Activity::Waiting;
        self.waiting = (unfetched || for_credit).then_some(Wait {
            since: now,
            for_credit,
        });
    }
}

impl Shared {
    pub(crate) fn new(device: Device, waker: UnixStream, started: Instant) -> Arc<Self> {
        Arc::new(Self {
            bench: Mutex::new(Running {
                device,
                stalled: false,
                host_connected: None,
                unplugged: false,
                halt_endpoint: false,
                ended: false,
                line: LineUse::default(),
                waiting: None,
            }),
            changed: Condvar::new(),
            waker,
            started,
        })
    }

    /// A panic elsewhere leaves the device in a state as good as any for a test to look at.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Running> {
        self.bench.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn now(&self) -> Duration {
        self.started.elapsed()
    }

    pub(crate) fn notify(&self) {
        self.changed.notify_all();
    }

    pub(crate) fn wake(&self) {
        // A full pipe means that a wake-up is under way already.
        let _ = (&self.waker).write(&[1]);
    }
}

/// What a test waited for did not come in time.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("waited {waited:?} in vain; the last events were {last:?}, the device is {snapshot:?}")]
pub struct WaitError {
    /// How long.
    pub waited: Duration,
    /// The latest events.
    pub last: Vec<Event>,
    /// How the device is.
    pub snapshot: Box<Snapshot>,
}

/// A hand on a running device. Clones share the device, but each waits on its own.
#[derive(Debug, Clone)]
pub struct Control {
    shared: Arc<Shared>,
    /// Number of the first event not yet waited for.
    next: u64,
}

impl Control {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        Self { shared, next: 0 }
    }

    fn act(&self, action: impl FnOnce(&mut Running, Duration)) {
        let now = self.shared.now();
        action(&mut self.shared.lock(), now);
        self.shared.wake();
        self.shared.notify();
    }

    /// Silences the device: it neither hears nor speaks until [`Control::resume`]. Its own
    /// clock goes on.
    pub fn stall(&self) {
        self.act(|running, _| running.stalled = true);
    }

    /// Ends a stall.
    pub fn resume(&self) {
        self.act(|running, _| running.stalled = false);
    }

    /// See [`Device::step_columns`].
    pub fn step_columns(&self, columns: Option<u32>) {
        self.act(|running, _| running.device.step_columns(columns));
    }

    /// See [`Device::drop_frames`].
    pub fn drop_frames(&self, frames: u32) {
        self.act(|running, _| running.device.drop_frames(frames));
    }

    /// See [`Device::corrupt_frames`].
    pub fn corrupt_frames(&self, frames: u32) {
        self.act(|running, _| running.device.corrupt_frames(frames));
    }

    /// See [`Device::send_garbage`].
    pub fn send_garbage(&self, bytes: &[u8]) {
        self.act(|running, _| running.device.send_garbage(bytes));
    }

    /// See [`Device::raise_faults`].
    pub fn raise_faults(&self, faults: Faults) {
        self.act(|running, now| running.device.raise_faults(faults, now));
    }

    /// See [`Device::mend`].
    pub fn mend(&self, faults: Faults) {
        self.act(|running, _| running.device.mend(faults));
    }

    /// Starts the firmware anew, with these bytes on the line before the banner.
    pub fn reset(&self, cause: ResetCause, garbage: &[u8]) {
        self.act(|running, now| {
            running.device.send_garbage(garbage);
            running.device.reset(cause, now);
        });
    }

    /// See [`Device::press_stop`].
    pub fn press_stop(&self) {
        self.act(|running, now| running.device.press_stop(now));
    }

    /// See [`Device::set_interlock`].
    pub fn set_interlock(&self, open: bool) {
        self.act(|running, now| running.device.set_interlock(open, now));
    }

    /// See [`Device::move_part`].
    pub fn move_part(&self, by_mm: crate::Vec3) {
        self.act(|running, _| running.device.move_part(by_mm));
    }

    /// Pulls the plug, with whatever is under way. On a pseudo-terminal all bytes are lost; the
    /// port stays, as that of a serial card does.
    pub fn unplug(&self) {
        self.act(|running, _| running.unplugged = true);
    }

    /// Puts the plug back. On the network a host must attach the device anew.
    pub fn replug(&self) {
        self.act(|running, _| running.unplugged = false);
    }

    /// Halts the endpoint to the host once, as firmware in trouble does; for endpoints on USB.
    pub fn halt_endpoint(&self) {
        self.act(|running, _| running.halt_endpoint = true);
    }

    /// What has gone over the line so far, and how long the device waited for the host.
    #[must_use]
    pub fn line_use(&self) -> LineUse {
        let running = self.shared.lock();
        let mut line = running.line;
        if let Some(wait) = running.waiting {
            line.add(wait, self.shared.now());
        }
        line
    }

    /// How the device is.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.shared.lock().device.snapshot(self.shared.now())
    }

    /// Whether a host has the port open; `None` for endpoints that cannot tell.
    #[must_use]
    pub fn host_connected(&self) -> Option<bool> {
        self.shared.lock().host_connected
    }

    /// Everything that has happened and is still remembered.
    #[must_use]
    pub fn events(&self) -> Vec<Event> {
        self.shared.lock().device.events()
    }

    /// The next event that is looked for, from the one last waited for on; those in between
    /// are passed over.
    ///
    /// # Errors
    /// [`WaitError`] when it has not come within the limit.
    pub fn wait_for(
        &mut self,
        limit: Duration,
        wanted: impl Fn(&Event) -> bool,
    ) -> Result<Event, WaitError> {
        let next = self.next;
        let (number, event) = self.wait(limit, |running, _| {
            running
                .device
                .log()
                .since(next)
                .find(|(_, event)| wanted(event))
        })?;
        self.next = number + 1;
        Ok(event)
    }

    /// Waits until the device is as wanted.
    ///
    /// # Errors
    /// [`WaitError`] when it has not become so within the limit.
    pub fn wait_until(
        &self,
        limit: Duration,
        wanted: impl Fn(&Snapshot) -> bool,
    ) -> Result<Snapshot, WaitError> {
        self.wait(limit, |running, now| {
            Some(running.device.snapshot(now)).filter(&wanted)
        })
    }

    /// Waits until a host has the device, or has it no more.
    ///
    /// # Errors
    /// [`WaitError`] when that has not come about within the limit.
    pub fn wait_for_host(&self, limit: Duration, connected: bool) -> Result<(), WaitError> {
        self.wait(limit, |running, _| {
            (running.host_connected == Some(connected)).then_some(())
        })
    }

    /// Passes over all that has happened so far.
    pub fn skip_events(&mut self) {
        self.next = self.shared.lock().device.log().end();
    }

    fn wait<T>(
        &self,
        limit: Duration,
        found: impl Fn(&Running, Duration) -> Option<T>,
    ) -> Result<T, WaitError> {
        let start = Instant::now();
        let mut running = self.shared.lock();
        loop {
            if let Some(found) = found(&running, self.shared.now()) {
                return Ok(found);
            }
            let waited = start.elapsed();
            if waited >= limit || running.ended {
                let last = running.device.events();
                return Err(WaitError {
                    waited,
                    last: last.iter().rev().take(12).rev().copied().collect(),
                    snapshot: Box::new(running.device.snapshot(self.shared.now())),
                });
            }
            running = self
                .shared
                .changed
                .wait_timeout(running, limit - waited)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}
