//! How long to wait before connecting again.

use std::time::Duration;

use crate::settings::LinkSettings;

/// Pauses that double up to a longest, each shortened by up to a quarter.
#[derive(Debug)]
pub(super) struct Backoff {
    first: Duration,
    longest: Duration,
    seed: u64,
    failures: u32,
}

impl Backoff {
    pub(super) fn new(settings: &LinkSettings) -> Self {
        Self {
            first: settings.reconnect_first,
            longest: settings.reconnect_longest,
            seed: settings.jitter_seed,
            failures: 0,
        }
    }

    /// The pause after another failure.
    pub(super) fn next(&mut self) -> Duration {
        let doubled = self
            .first
            .saturating_mul(1_u32.checked_shl(self.failures).unwrap_or(u32::MAX))
            .min(self.longest);
        self.failures = self.failures.saturating_add(1);
        // 2^32 in the divisor takes the upper half of the draw as a fraction of one.
        let fraction = (mix(self.seed.wrapping_add(u64::from(self.failures))) >> 32) as f64
            / f64::from(u32::MAX);
        doubled.mul_f64(1.0 - fraction / 4.0)
    }

    /// It worked: the next failure starts from the first pause.
    pub(super) fn reset(&mut self) {
        self.failures = 0;
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood, 2014): every input bit reaches every
/// output bit, which is all that jitter needs.
fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_with_jitter_up_to_the_longest() {
        let settings = LinkSettings::default();
        let pauses = |seed| {
            let mut backoff = Backoff::new(&LinkSettings {
                jitter_seed: seed,
                ..settings.clone()
            });
            (0..40).map(|_| backoff.next()).collect::<Vec<_>>()
        };
        let seen = pauses(1);
        for (k, pause) in seen.iter().enumerate() {
            let full = settings
                .reconnect_first
                .saturating_mul(1 << k.min(20))
                .min(settings.reconnect_longest);
            assert!(
                *pause <= full && *pause >= full.mul_f64(0.75),
                "{k}: {pause:?}"
            );
        }
        assert_eq!(seen, pauses(1));
        assert_ne!(seen, pauses(2));
    }

    #[test]
    fn success_starts_over() {
        let mut backoff = Backoff::new(&LinkSettings::default());
        let first = backoff.next();
        backoff.next();
        backoff.reset();
        assert_eq!(backoff.next(), first);
    }
}
