//! When a message that was not taken is tried again.

use std::time::Duration;

use crate::config::Retry;

/// By how much longer each wait is than the one before.
const FACTOR: u32 = 3;
/// A message is not tried more often than this, though each start of the service tries all of
/// them: then the service starts too often, and not the receiver is to blame.
const MOST_ATTEMPTS: u32 = 100;
/// Share by which a wait may be shorter or longer, so that messages that failed together, of
/// several services too, do not come back together.
const JITTER: f64 = 0.2;

/// How long to wait after so many attempts. `chance` is drawn from 0 to 1.
pub(super) fn delay(retry: &Retry, attempts: u32, chance: f64) -> Duration {
    let steps = attempts.saturating_sub(1);
    let factor = FACTOR.saturating_pow(steps.min(20));
    let wait = retry.first.saturating_mul(factor).min(retry.longest);
    wait.mul_f64(1.0 + JITTER * (2.0 * chance - 1.0))
}

/// Whether a message of this age has been tried for long enough.
pub(super) fn is_enough(retry: &Retry, attempts: u32, age: Duration) -> bool {
    attempts >= MOST_ATTEMPTS || (attempts >= retry.attempts && age >= retry.lasting)
}

/// A number from 0 to 1. The middle will do where the system has no random bytes.
pub(super) fn chance() -> f64 {
    getrandom::u32().map_or(0.5, |number| f64::from(number) / f64::from(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_to_hours_and_last_for_about_a_day() {
        let retry = Retry::default();
        let waits: Vec<u64> = (1..=10)
            .map(|attempts| delay(&retry, attempts, 0.5).as_secs())
            .collect();
        assert_eq!(
            waits,
            [5, 15, 45, 135, 405, 1_215, 3_645, 10_935, 14_400, 14_400]
        );
        assert_eq!(delay(&retry, u32::MAX, 0.5).as_secs(), 14_400);
        // Whatever is drawn, a receiver that is back the next day is told.
        for chance in [0.0, 0.5, 1.0] {
            let (mut age, mut attempts) = (Duration::ZERO, 1);
            while !is_enough(&retry, attempts, age) {
                age += delay(&retry, attempts, chance);
                attempts += 1;
            }
            let hours = age.as_secs_f64() / 3_600.0;
            assert!((24.0..29.0).contains(&hours), "{hours} h");
            assert!((13..18).contains(&attempts), "{attempts}");
        }
    }

    #[test]
    fn a_clock_that_jumps_takes_no_message_its_chances() {
        let retry = Retry::default();
        let years = Duration::from_secs(50 * 365 * 86_400);
        assert!(!is_enough(&retry, 7, years));
        assert!(is_enough(&retry, 8, years));
        assert!(!is_enough(&retry, 99, Duration::ZERO));
        assert!(is_enough(&retry, 100, Duration::ZERO));
    }

    #[test]
    fn waits_are_scattered() {
        let retry = Retry::default();
        assert_eq!(delay(&retry, 1, 0.0), Duration::from_secs(4));
        assert_eq!(delay(&retry, 1, 1.0), Duration::from_secs(6));
        let drawn: Vec<f64> = (0..20).map(|_| chance()).collect();
        assert!(drawn.iter().all(|c| (0.0..=1.0).contains(c)), "{drawn:?}");
        assert!(drawn.iter().any(|c| c != &drawn[0]), "{drawn:?}");
    }
}
