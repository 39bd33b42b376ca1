//! The slide table: where it says it is, and where it is.

use crate::random::{Draws, Purpose};

/// How truly the table moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanics {
    /// Scatter of the stops about their nominal places, millimetres (1 sigma). The encoder
    /// sees it, so the reported position follows.
    pub jitter_mm: f64,
    /// Scatter of the true position about the reported one, millimetres (1 sigma).
    pub encoder_noise_mm: f64,
    /// Play of the lead screw, millimetres: while travelling towards -x the table lags behind
    /// the reported position by this much.
    pub backlash_mm: f64,
    /// Speed between two stops and on the way to the first, millimetres per second.
    pub speed_mm_s: f64,
    /// Travel per count of the encoder, nanometres.
    pub count_nm: u32,
}

/// A stop of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// What the encoder says.
    pub reported_counts: i32,
    /// Where the object really is, less where the report puts it, millimetres.
    pub error_mm: f64,
}

impl Mechanics {
    /// Travel per count, millimetres.
    #[must_use]
    pub fn count_mm(&self) -> f64 {
        f64::from(self.count_nm) * 1e-6
    }

    /// The stop of a column whose place in the plan is `nominal_counts`.
    ///
    /// `key` names the column; the same key gives the same stop.
    #[must_use]
    pub fn stop(&self, seed: u64, key: &[u64], nominal_counts: i32, backwards: bool) -> Stop {
        let mut draws = Draws::keyed(seed, Purpose::Table, key);
        let jitter = draws.normal() * self.jitter_mm / self.count_mm();
        let slip = draws.normal() * self.encoder_noise_mm;
        let play = if backwards { self.backlash_mm } else { 0.0 };
        Stop {
            reported_counts: nominal_counts.saturating_add(libm::round(jitter) as i32),
            error_mm: slip + play,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mechanics() -> Mechanics {
        Mechanics {
            jitter_mm: 0.0,
            encoder_noise_mm: 0.0,
            backlash_mm: 0.0,
            speed_mm_s: 50.0,
            count_nm: 10_000,
        }
    }

    #[test]
    fn a_true_table_stops_where_it_is_told() {
        let stop = mechanics().stop(1, &[0], -1234, true);
        assert_eq!((stop.reported_counts, stop.error_mm), (-1234, 0.0));
    }

    #[test]
    fn backlash_shows_on_the_way_back_only() {
        let table = Mechanics {
            backlash_mm: 0.08,
            ..mechanics()
        };
        assert_eq!(table.stop(1, &[0], 5, false).error_mm, 0.0);
        assert_eq!(table.stop(1, &[0], 5, true).error_mm, 0.08);
    }

    #[test]
    fn jitter_is_reported_and_encoder_noise_is_not() {
        let table = Mechanics {
            jitter_mm: 0.05,
            encoder_noise_mm: 0.02,
            ..mechanics()
        };
        let stops: Vec<Stop> = (0..2000).map(|i| table.stop(9, &[i], 0, false)).collect();
        let sigma = |values: Vec<f64>| {
            libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64)
        };
        let reported = sigma(stops.iter().map(|s| f64::from(s.reported_counts)).collect());
        assert!((reported - 5.0).abs() < 0.3, "{reported}");
        let error = sigma(stops.iter().map(|s| s.error_mm).collect());
        assert!((error - 0.02).abs() < 0.001, "{error}");
        assert_eq!(stops[7], table.stop(9, &[7], 0, false));
    }
}
