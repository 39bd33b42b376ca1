//! How long a laser has been on.

use std::time::{Duration, Instant};

/// How long a laser has been on, whatever the clock is set to meanwhile.
#[derive(Debug, Default)]
pub(super) struct OnTime {
    before: Duration,
    since: Option<Instant>,
}

impl OnTime {
    /// It is on, or not, from now on.
    pub(super) fn note(&mut self, on: bool) {
        let total = self.total();
        self.before = total;
        self.since = on.then(Instant::now);
    }

    pub(super) fn total(&self) -> Duration {
        self.before + self.since.map_or(Duration::ZERO, |since| since.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_time_that_it_is_on_counts() {
        let mut time = OnTime::default();
        assert_eq!(time.total(), Duration::ZERO);
        let begun = Instant::now();
        time.note(true);
        while begun.elapsed() < Duration::from_millis(2) {}
        // Once more changes nothing.
        time.note(true);
        assert!(time.total() >= Duration::from_millis(1));
        time.note(false);
        let total = time.total();
        assert!(total <= begun.elapsed());
        assert_eq!(time.total(), total, "off");
    }
}
