//! Every time, number of attempts and buffer size of the link, in one place.

use std::time::Duration;

use crate::error::ScannerError;
use crate::limits::{MAX_CREDITS, MAX_OVERLAP};

/// How patiently the driver talks to a scanner.
///
/// The defaults suit a serial line of 115,200 baud or more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkSettings {
    /// How long a request waits for its reply before it is repeated.
    ///
    /// Replies overtake column data in the device, so that this covers only what is in
    /// the buffers of the line already.
    pub request_timeout: Duration,
    /// How often a request is sent before it is given up.
    pub request_attempts: u32,
    /// Longest pause between two frames of the host.
    pub heartbeat_interval: Duration,
    /// The dead-man time asked of the device: after so long without a frame from the host it
    /// turns the laser off and stops the table. At least three heartbeats.
    pub dead_man: Duration,
    /// After so long without a good frame from the device, in spite of requests, the
    /// connection is given up. At least one request with all its attempts.
    pub silence: Duration,
    /// How often the status is asked for while the table homes or moves.
    pub motion_poll: Duration,
    /// Longest homing or move.
    pub motion_timeout: Duration,
    /// Columns in flight: sent by the device and not yet acknowledged. Bounds the memory
    /// of the driver. The device may allow fewer.
    pub credits: u16,
    /// How long to wait for missing fragments before they are asked for again.
    pub resend_timeout: Duration,
    /// How often missing fragments of one column are asked for, without any coming,
    /// before the scan is given up.
    pub resend_attempts: u32,
    /// Longest wait for the next column of a scan while credit is there.
    pub column_timeout: Duration,
    /// Pause before the first attempt to connect again.
    pub reconnect_first: Duration,
    /// Longest pause between attempts to connect again; the pause doubles up to this.
    pub reconnect_longest: Duration,
    /// How a scan goes on after an interruption; `None` lets the first trouble end it.
    pub resume: Option<ResumeSettings>,
    /// Seed of the jitter on those pauses (up to a quarter, so that several hosts which
    /// lost the same hub do not come back in step).
    pub jitter_seed: u64,
}

/// How a scan goes on after an interruption.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResumeSettings {
    /// Fewest columns measured again, to prove that neither table nor object has moved; where
    /// they hold little, more are taken, up to [`crate::limits::MAX_OVERLAP`], and in a gap of
    /// the object the last columns before it as well. At least 1.
    pub overlap_columns: u16,
    /// Attempts to go on without a new column, before a person is asked.
    pub attempts: u32,
    /// Longest pause after which the laser may go on again without a person's word.
    pub unattended: Duration,
    /// Pause before the first attempt to go on.
    pub first_pause: Duration,
    /// Longest pause between attempts; the pause doubles up to this.
    pub longest_pause: Duration,
}

impl Default for ResumeSettings {
    fn default() -> Self {
        Self {
            overlap_columns: 2,
            attempts: 10,
            unattended: Duration::from_secs(15 * 60),
            first_pause: Duration::from_millis(250),
            longest_pause: Duration::from_secs(10),
        }
    }
}

impl Default for LinkSettings {
    fn default() -> Self {
        Self {
            request_timeout: Duration::from_millis(300),
            request_attempts: 6,
            heartbeat_interval: Duration::from_millis(400),
            dead_man: Duration::from_secs(2),
            silence: Duration::from_secs(3),
            motion_poll: Duration::from_millis(100),
            motion_timeout: Duration::from_secs(120),
            credits: 32,
            resend_timeout: Duration::from_millis(300),
            resend_attempts: 12,
            column_timeout: Duration::from_secs(30),
            reconnect_first: Duration::from_millis(250),
            reconnect_longest: Duration::from_secs(10),
            resume: None,
            jitter_seed: 0,
        }
    }
}

impl LinkSettings {
    /// Checks that the settings agree with each other.
    ///
    /// # Errors
    /// [`ScannerError::Settings`], saying which does not.
    pub fn validate(&self) -> Result<(), ScannerError> {
        let wrong = |what: &str| Err(ScannerError::Settings(format!("link settings: {what}")));
        let shortest = Duration::from_millis(1);
        let times = [
            (self.request_timeout, "request_timeout"),
            (self.heartbeat_interval, "heartbeat_interval"),
            (self.motion_poll, "motion_poll"),
            (self.motion_timeout, "motion_timeout"),
            (self.resend_timeout, "resend_timeout"),
            (self.column_timeout, "column_timeout"),
            (self.reconnect_first, "reconnect_first"),
        ];
        if let Some((_, name)) = times.iter().find(|(time, _)| *time < shortest) {
            return wrong(&format!("{name} must be at least 1 ms"));
        }
        if self.request_attempts == 0 || self.resend_attempts == 0 {
            return wrong("request_attempts and resend_attempts must be at least 1");
        }
        if self.dead_man < self.heartbeat_interval * 3 {
            return wrong("dead_man must be at least three times heartbeat_interval");
        }
        if self.dead_man < self.request_timeout * 3 {
            return wrong("dead_man must be at least three times request_timeout");
        }
        if self.dead_man > Duration::from_millis(u64::from(u16::MAX)) {
            return wrong("dead_man must be at most 65 s");
        }
        if self.silence < self.request_timeout * self.request_attempts {
            return wrong("silence must be at least request_timeout times request_attempts");
        }
        if self.credits == 0 || self.credits > MAX_CREDITS {
            return wrong(&format!("credits must be 1 to {MAX_CREDITS}"));
        }
        if self.reconnect_longest < self.reconnect_first {
            return wrong("reconnect_longest must not be below reconnect_first");
        }
        if let Some(resume) = &self.resume {
            if resume.overlap_columns == 0 || resume.overlap_columns > MAX_OVERLAP {
                return wrong(&format!("overlap_columns must be 1 to {MAX_OVERLAP}"));
            }
            if resume.attempts == 0 || resume.first_pause < shortest {
                return wrong("attempts and first_pause must not be 0");
            }
            if resume.longest_pause < resume.first_pause {
                return wrong("longest_pause must not be below first_pause");
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_agree_with_each_other() {
        assert_eq!(LinkSettings::default().validate(), Ok(()));
    }

    #[test]
    fn contradictions_are_named() {
        let check = |change: fn(&mut LinkSettings), named: &str| {
            let mut settings = LinkSettings::default();
            change(&mut settings);
            let error = settings.validate().expect_err(named).to_string();
            assert!(error.contains(named), "{error}");
        };
        check(|s| s.dead_man = s.heartbeat_interval, "dead_man");
        check(|s| s.dead_man = Duration::from_secs(70), "dead_man");
        check(|s| s.silence = s.request_timeout, "silence");
        check(|s| s.credits = 0, "credits");
        check(|s| s.request_attempts = 0, "request_attempts");
        check(|s| s.resend_timeout = Duration::ZERO, "resend_timeout");
        check(
            |s| s.reconnect_longest = Duration::ZERO,
            "reconnect_longest",
        );
    }
}
