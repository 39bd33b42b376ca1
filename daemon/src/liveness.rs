//! Whether every loop of the service still turns.
//!
//! A loop that does work holds a [`Pulse`]: it says when it begins to work, gives signs of
//! life while it does, and says when it waits, which it may do for as long as it likes. The
//! watchdog looks at all of them; one that has worked for too long without a sign is stuck.
//! Giving a sign costs one read of memory, so that it can be done in the innermost loops.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::service::lock;

/// Every loop that is running.
#[derive(Debug, Default)]
pub(crate) struct Liveness {
    loops: Mutex<Vec<Loop>>,
}

/// What the watchdog knows of one loop.
#[derive(Debug)]
struct Loop {
    state: Arc<State>,
    /// When it was last seen to turn, or to wait.
    turned: Option<Instant>,
}

#[derive(Debug)]
struct State {
    name: String,
    /// How long it may work between two signs.
    longest: Mutex<Duration>,
    working: AtomicBool,
    turned: AtomicBool,
    ended: AtomicBool,
    panicked: AtomicBool,
}

/// A loop's way to tell that it turns. The loop ends when this is dropped.
#[derive(Debug)]
pub(crate) struct Pulse(Arc<State>);

/// A loop that does not turn any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Stuck {
    /// It works, and gives no sign.
    #[error("{name} has given no sign of life for {} s", silence.as_secs())]
    Silent {
        /// The loop's name.
        name: String,
        /// For how long.
        silence: Duration,
    },
    /// It ended, and should not have.
    #[error("{name} ended by a panic")]
    Panicked {
        /// The loop's name.
        name: String,
    },
}

impl Liveness {
    /// A loop begins. Until it says otherwise, it waits.
    pub(crate) fn begin(&self, name: impl Into<String>) -> Pulse {
        let state = Arc::new(State {
            name: name.into(),
            longest: Mutex::default(),
            working: AtomicBool::new(false),
            turned: AtomicBool::new(true),
            ended: AtomicBool::new(false),
            panicked: AtomicBool::new(false),
        });
        lock(&self.loops).push(Loop {
            state: Arc::clone(&state),
            turned: None,
        });
        Pulse(state)
    }

    /// Looks at every loop; to be called at short and regular intervals.
    ///
    /// # Errors
    /// The first loop that is stuck.
    pub(crate) fn check(&self, now: Instant) -> Result<(), Stuck> {
        let mut loops = lock(&self.loops);
        loops.retain(|watched| !watched.state.ended.load(Ordering::Acquire));
        let mut found = Ok(());
        for watched in loops.iter_mut() {
            let state = watched.check(now);
            if found.is_ok() {
                found = state;
            }
        }
        found
    }
}

impl Loop {
    fn check(&mut self, now: Instant) -> Result<(), Stuck> {
        let state = &self.state;
        let name = || state.name.clone();
        if state.panicked.load(Ordering::Acquire) {
            return Err(Stuck::Panicked { name: name() });
        }
        let turned = state.turned.swap(false, Ordering::Acquire);
        if turned || !state.working.load(Ordering::Acquire) {
            self.turned = Some(now);
            return Ok(());
        }
        let silence = now.saturating_duration_since(*self.turned.get_or_insert(now));
        if silence > *lock(&state.longest) {
            return Err(Stuck::Silent {
                name: name(),
                silence,
            });
        }
        Ok(())
    }
}

impl Pulse {
    /// Work begins, or another piece of it; the next sign comes within this time.
    pub(crate) fn work(&self, longest: Duration) {
        *lock(&self.0.longest) = longest;
        self.0.working.store(true, Ordering::Release);
        self.beat();
    }

    /// A sign of life.
    pub(crate) fn beat(&self) {
        // Many threads may work for one loop, and only one of them need write.
        if !self.0.turned.load(Ordering::Relaxed) {
            self.0.turned.store(true, Ordering::Release);
        }
    }

    /// There is nothing to do until something comes.
    pub(crate) fn rest(&self) {
        self.0.working.store(false, Ordering::Release);
    }
}

impl Drop for Pulse {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.panicked.store(true, Ordering::Release);
        } else {
            self.0.ended.store(true, Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_secs(10);

    fn after(start: Instant, seconds: u64) -> Instant {
        start + Duration::from_secs(seconds)
    }

    #[test]
    fn a_loop_may_wait_for_ever_but_not_work_without_a_sign() {
        let (liveness, start) = (Liveness::default(), Instant::now());
        let pulse = liveness.begin("worker-1");
        for day in 0..3 {
            assert_eq!(liveness.check(after(start, day * 86_400)), Ok(()));
        }
        let start = after(start, 3 * 86_400);
        pulse.work(LIMIT);
        assert_eq!(liveness.check(start), Ok(()));
        assert_eq!(liveness.check(after(start, 10)), Ok(()));
        let stuck = liveness.check(after(start, 11)).unwrap_err();
        assert_eq!(
            stuck.to_string(),
            "worker-1 has given no sign of life for 11 s"
        );
        // It was only slow.
        pulse.beat();
        assert_eq!(liveness.check(after(start, 12)), Ok(()));
        assert_eq!(liveness.check(after(start, 22)), Ok(()));
        pulse.rest();
        assert_eq!(liveness.check(after(start, 1000)), Ok(()));
    }

    #[test]
    fn each_loop_counts_and_one_that_has_ended_does_not() {
        let (liveness, start) = (Liveness::default(), Instant::now());
        let (first, second) = (liveness.begin("first"), liveness.begin("second"));
        first.work(LIMIT);
        second.work(2 * LIMIT);
        assert_eq!(liveness.check(start), Ok(()));
        let silent = |seconds| liveness.check(after(start, seconds)).unwrap_err();
        assert!(matches!(silent(11), Stuck::Silent { name, .. } if name == "first"));
        drop(first);
        assert_eq!(liveness.check(after(start, 12)), Ok(()));
        assert!(matches!(silent(21), Stuck::Silent { name, .. } if name == "second"));
        drop(second);
        assert_eq!(liveness.check(after(start, 30)), Ok(()));
    }

    #[test]
    fn a_loop_that_panics_is_stuck_for_good() {
        let (liveness, start) = (Arc::new(Liveness::default()), Instant::now());
        let pulse = liveness.begin("scanner-watch");
        let thread = std::thread::spawn(move || {
            let _pulse = pulse;
            std::panic::resume_unwind(Box::new("on purpose"));
        });
        assert!(thread.join().is_err());
        for seconds in [0, 1000] {
            let stuck = liveness.check(after(start, seconds)).unwrap_err();
            assert_eq!(stuck.to_string(), "scanner-watch ended by a panic");
        }
    }
}
