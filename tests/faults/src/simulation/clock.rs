//! The host's clock, which may leap ahead of the time that passes.

use std::time::Duration;

/// A clock that is ahead of the simulation's time, and never runs backwards: the driver's does
/// not either, since it counts from the computer's start.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct HostClock {
    ahead: Duration,
}

impl HostClock {
    /// What it shows at this time.
    pub(super) fn shows(self, time: Duration) -> Duration {
        time + self.ahead
    }

    /// The time at which it shows this, or an earlier one if it has leapt beyond it.
    pub(super) fn time(self, shown: Duration) -> Duration {
        shown.saturating_sub(self.ahead)
    }

    pub(super) fn leap(&mut self, by: Duration) {
        self.ahead += by;
    }
}
