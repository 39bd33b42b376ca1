//! The place where something is the least, found without its slope.

use rayon::prelude::*;

/// Of places between two, where `left` is the least: the best of `first` evenly spread, and then of
/// those beside it, at half the distance so many times. `first` is at least 2.
pub(crate) fn least(
    (low, high): (f64, f64),
    (first, halvings): (u32, u32),
    left: impl Fn(f64) -> f64 + Sync,
) -> f64 {
    let of = |at: f64| {
        let at = at.clamp(low, high);
        (left(at), at)
    };
    let less = |a: (f64, f64), b: (f64, f64)| if b.0 < a.0 { b } else { a };
    let mut step = (high - low) / f64::from(first - 1);
    let all = (0..first)
        .into_par_iter()
        .map(|k| of(low + step * f64::from(k)));
    let all: Vec<(f64, f64)> = all.collect();
    let mut best = all.into_iter().fold((f64::INFINITY, low), less);
    for _ in 0..halvings {
        step /= 2.0;
        let (below, above) = rayon::join(|| of(best.1 - step), || of(best.1 + step));
        best = less(less(best, below), above);
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deeper_of_two_valleys_is_found() {
        let valleys = |at: f64| ((at - 2.0).abs() + 0.1).min((at - 7.06).abs());
        let found = least((0.0, 10.0), (11, 20), valleys);
        assert!((found - 7.06).abs() < 1e-4, "{found}");
    }

    #[test]
    fn nothing_is_looked_at_beyond_the_ends() {
        let falling = |at: f64| {
            assert!((1.0..=4.0).contains(&at), "{at}");
            -at
        };
        assert_eq!(least((1.0, 4.0), (5, 10), falling), 4.0);
        // Nowhere is anything told.
        assert_eq!(least((1.0, 4.0), (5, 10), |_| f64::NAN), 1.0);
    }
}
