//! The table's drive: where it is at a time.

use core::time::Duration;

/// A table that stands, or travels at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    from_counts: i32,
    to_counts: i32,
    since: Duration,
    until: Duration,
}

impl Drive {
    pub(crate) fn standing(at_counts: i32) -> Self {
        Self {
            from_counts: at_counts,
            to_counts: at_counts,
            since: Duration::ZERO,
            until: Duration::ZERO,
        }
    }

    /// Sets out for a position; `counts_per_s` may be infinite.
    pub(crate) fn go(&mut self, to_counts: i32, counts_per_s: f64, now: Duration) {
        let from_counts = self.at(now);
        let distance = (f64::from(to_counts) - f64::from(from_counts)).abs();
        let seconds = (distance / counts_per_s).min(3600.0);
        *self = Self {
            from_counts,
            to_counts,
            since: now,
            until: now + Duration::from_secs_f64(seconds.max(0.0)),
        };
    }

    /// Stops where it is.
    pub(crate) fn stop(&mut self, now: Duration) {
        *self = Self::standing(self.at(now));
    }

    pub(crate) fn moves(&self, now: Duration) -> bool {
        now < self.until
    }

    /// When it arrives.
    pub(crate) fn arrival(&self) -> Duration {
        self.until
    }

    pub(crate) fn at(&self, now: Duration) -> i32 {
        if now >= self.until {
            return self.to_counts;
        }
        let part =
            now.saturating_sub(self.since).as_secs_f64() / (self.until - self.since).as_secs_f64();
        let way = f64::from(self.to_counts) - f64::from(self.from_counts);
        (f64::from(self.from_counts) + way * part) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_takes_its_time_and_can_be_stopped() {
        let second = Duration::from_secs(1);
        let mut drive = Drive::standing(100);
        drive.go(300, 50.0, second);
        assert_eq!(drive.arrival(), 5 * second);
        assert_eq!((drive.at(second), drive.at(3 * second)), (100, 200));
        assert!(drive.moves(4 * second) && !drive.moves(5 * second));
        drive.stop(2 * second);
        assert_eq!(
            (drive.at(9 * second), drive.moves(2 * second)),
            (150, false)
        );
        drive.go(-7, f64::INFINITY, 2 * second);
        assert_eq!(drive.at(2 * second), -7);
    }
}
