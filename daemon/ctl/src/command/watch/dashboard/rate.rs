//! How fast columns come, and how long the rest will take.

use std::collections::VecDeque;

/// What lies longer ago, in seconds, no longer counts.
const WINDOW_S: f64 = 10.0;

/// Columns of a scan by when they came.
#[derive(Debug, Default)]
pub(super) struct Rate {
    counts: VecDeque<(f64, u32)>,
}

impl Rate {
    /// So many columns were there at this moment.
    pub(super) fn push(&mut self, at_s: f64, columns: u32) {
        if self.counts.back().is_some_and(|(_, last)| *last > columns) {
            self.counts.clear();
        }
        self.counts.push_back((at_s, columns));
        // The one before the window stays: it tells since when.
        while self
            .counts
            .get(1)
            .is_some_and(|(at, _)| at_s - at > WINDOW_S)
        {
            self.counts.pop_front();
        }
    }

    /// Columns a second; `None` until two came, or when none has come for a while.
    pub(super) fn per_second(&self, now_s: f64) -> Option<f64> {
        let (&(first_s, first), &(last_s, last)) = (self.counts.front()?, self.counts.back()?);
        let is_old = now_s - last_s > WINDOW_S;
        (last > first && last_s > first_s && !is_old)
            .then(|| f64::from(last - first) / (last_s - first_s))
    }
}

/// Seconds for people.
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02} min"),
        (h, m, _) => format!("{h}:{m:02} h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_the_last_seconds() {
        let mut rate = Rate::default();
        assert_eq!(rate.per_second(0.0), None);
        for second in 0..30_u32 {
            // Two a second at first, five later.
            let columns = if second < 15 {
                2 * second
            } else {
                30 + 5 * (second - 15)
            };
            rate.push(f64::from(second), columns);
        }
        assert_eq!(rate.per_second(29.0), Some(5.0));
        assert_eq!(rate.per_second(60.0), None, "it has stopped");
        rate.push(61.0, 0);
        assert_eq!(rate.per_second(61.0), None, "another scan");
        rate.push(63.0, 1);
        assert_eq!(rate.per_second(63.0), Some(0.5));
    }

    #[test]
    fn durations_are_short() {
        let told = [0.4, 59.6, 61.0, 3600.0, 7384.0].map(duration);
        assert_eq!(told, ["0 s", "1:00 min", "1:01 min", "1:00 h", "2:03 h"]);
    }
}
