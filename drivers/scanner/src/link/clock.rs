//! The time that a session goes by.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Time since a start, that in which the computer was suspended included: a scanner and the
/// people around it live through it as well.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    start: Duration,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self {
            start: since_boot(),
        }
    }

    /// The seconds at the start, around the circle of tags: so requests are numbered ahead of
    /// those of a program that had the device before.
    pub(super) fn first_tag(self) -> u16 {
        self.start.as_secs() as u16
    }

    pub(super) fn now(self) -> Duration {
        since_boot().saturating_sub(self.start)
    }
}

/// [`std::time::Instant`] stands still while the computer is suspended.
fn since_boot() -> Duration {
    let time = clock_gettime(ClockId::Boottime);
    // It is never negative.
    Duration::try_from(time).unwrap_or_default()
}
