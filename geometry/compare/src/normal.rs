//! The normal distribution and robust statistics.

/// The value that a standard normal variable exceeds in size with this probability, 0 to 1.
pub(crate) fn two_sided_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..80 {
        let middle = (low + high) / 2.0;
        if libm::erfc(middle / core::f64::consts::SQRT_2) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low + high) / 2.0
}

/// Median absolute deviation to standard deviation of a normal distribution.
pub(crate) const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// The middle value; NaN of nothing. Reorders the values.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Robust standard deviation about zero: of values, their sizes' median made one.
pub(crate) fn scale_about_zero(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    MAD_TO_SIGMA * median(&mut sizes)
}

/// Beyond this many standard deviations Tukey's biweight takes no notice; 95 % efficient.
pub(crate) const TUKEY: f64 = 4.685;

/// Tukey's biweight of a residual in standard deviations.
pub(crate) fn biweight(residual: f64) -> f64 {
    let share = residual / TUKEY;
    let rest = 1.0 - share * share;
    if rest > 0.0 { rest * rest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (probability, quantile) in [(0.05, 1.959_964), (0.01, 2.575_829), (1e-6, 4.891_638)] {
            assert!((two_sided_quantile(probability) - quantile).abs() < 1e-5);
        }
        assert!(two_sided_quantile(1.0) < 1e-9);
    }

    #[test]
    fn medians_withstand_outliers() {
        assert_eq!(median(&mut [1e9, 1.0, 2.0]), 2.0);
        assert!(median(&mut []).is_nan());
        assert_eq!((biweight(0.0), biweight(5.0)), (1.0, 0.0));
    }
}
