//! The laser, watched from outside: what must hold whatever driver and device make of it.

use std::time::Duration;

use anyhow::{Result, ensure};
use scanner_protocol::Activity;

use super::Simulation;

/// How long the device is watched after the scan's end: longer than its dead-man time.
const AFTERWARDS: Duration = Duration::from_secs(10);

/// How much longer than promised the laser may be on, or may have been off: bytes are under
/// way, held back on the line, or lie between two looks at it.
const SLACK: Duration = Duration::from_secs(2);

/// What is known of the laser.
#[derive(Debug, Default)]
pub(super) struct Guard {
    /// When it was last on, or a person last said that it may be.
    fine: Option<Duration>,
    asleep_since: Option<Duration>,
}

impl Guard {
    pub(super) fn word_given(&mut self, now: Duration) {
        self.fine = Some(now);
    }

    pub(super) fn fell_asleep(&mut self, now: Duration) {
        self.asleep_since.get_or_insert(now);
    }
}

impl Simulation {
    /// The laser is off while a person is waited for and while the host sleeps, at the latest
    /// after the dead-man time; and it does not go on again by itself once it has been off for
    /// so long that somebody may have come to the table.
    pub(super) fn watch_the_laser(&mut self) -> Result<()> {
        let seed = self.conditions.seed;
        if self.now >= self.asleep_until {
            self.guard.asleep_since = None;
        }
        if !self.device.snapshot(self.now).laser_on {
            return Ok(());
        }
        let longest = self.settings.dead_man + SLACK;
        ensure!(
            self.asked_since
                .is_none_or(|since| self.now <= since + longest),
            "seed {seed}: the laser is on while a person is waited for: {:?}",
            self.told
        );
        let asleep = self.guard.asleep_since;
        ensure!(
            asleep.is_none_or(|since| self.now <= since + longest),
            "seed {seed}: the laser is on while the host sleeps since {asleep:?}: {:?}",
            self.told
        );
        if let (Some(fine), Some(resume)) = (self.guard.fine, &self.settings.resume) {
            ensure!(
                self.now <= fine + resume.unattended + SLACK,
                "seed {seed}: the laser goes on by itself {:?} after it was last on: {:?}",
                self.now - fine,
                self.told
            );
        }
        self.guard.fine = Some(self.now);
        Ok(())
    }

    /// The laser is off some time after the end, whatever else is, and a complete scan is
    /// closed.
    pub(super) fn watch_the_end(&mut self) -> Result<()> {
        let until = self.now.max(self.asleep_until) + AFTERWARDS;
        while self.now < until {
            self.turn()?;
        }
        let snapshot = self.device.snapshot(self.now);
        let seed = self.conditions.seed;
        ensure!(
            !snapshot.laser_on,
            "seed {seed}: the laser is on after the scan"
        );
        let busy = matches!(snapshot.activity, Activity::Scanning | Activity::Waiting);
        ensure!(!busy, "seed {seed}: the device scans on: {snapshot:?}");
        ensure!(
            !self.complete || snapshot.columns_sent == 0,
            "seed {seed}: the scan is never closed: {snapshot:?}"
        );
        Ok(())
    }
}
