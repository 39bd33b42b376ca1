//! The same figure of several scans: how it scatters, and how it drifts.

use crate::robust::deviation;

/// How a figure repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeatability {
    /// Its mean, in the figure's unit.
    pub mean: f64,
    /// Standard deviation of single values.
    pub standard_deviation: f64,
    /// Largest less smallest value.
    pub range: f64,
    /// How many values.
    pub count: usize,
}

/// How a figure changes with time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Change for each hour.
    pub slope_per_h: f64,
    /// Its standard uncertainty, from the scatter about the line.
    pub uncertainty_per_h: f64,
    /// From the first to the last value along the line.
    pub change: f64,
    /// Hours after the first value from which on all values lie within the scatter of the last
    /// ones; `None` if they still move.
    pub settled_after_h: Option<f64>,
}

/// Values within so many standard deviations of the last ones' mean have settled.
const SETTLED: f64 = 3.0;
/// Fewest values for a drift.
pub const FEWEST_FOR_DRIFT: usize = 5;
/// The last ones are this share of all, and at least two.
const LAST: f64 = 0.4;
/// A slope of less than so many uncertainties is none.
const SIGNIFICANT: f64 = 2.0;

/// How values repeat; `None` of fewer than two.
#[must_use]
pub fn repeatability(values: &[f64]) -> Option<Repeatability> {
    let count = values.len();
    if count < 2 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / count as f64;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(Repeatability {
        mean,
        standard_deviation: libm::sqrt(squares / (count - 1) as f64),
        range: high - low,
        count,
    })
}

/// How values change with the hours since the first; `None` of fewer than [`FEWEST_FOR_DRIFT`], or
/// if all were taken at one time.
#[must_use]
pub fn drift(values: &[(f64, f64)]) -> Option<Drift> {
    let mut values = values.to_vec();
    values.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let count = values.len();
    if count < FEWEST_FOR_DRIFT {
        return None;
    }
    let (slope_per_h, uncertainty_per_h) = line(&values)?;
    let (first_h, last_h) = (values.first()?.0, values.last()?.0);
    Some(Drift {
        slope_per_h,
        uncertainty_per_h,
        change: slope_per_h * (last_h - first_h),
        settled_after_h: settled(&values).map(|at_h| at_h - first_h),
    })
}

/// Slope of the line of least squares, and its standard uncertainty.
fn line(values: &[(f64, f64)]) -> Option<(f64, f64)> {
    let count = values.len() as f64;
    let mean_h = values.iter().map(|(h, _)| h).sum::<f64>() / count;
    let mean = values.iter().map(|(_, v)| v).sum::<f64>() / count;
    let wide: f64 = values
        .iter()
        .map(|(h, _)| (h - mean_h) * (h - mean_h))
        .sum();
    if wide <= 0.0 || values.len() < 3 {
        return None;
    }
    let slope = values
        .iter()
        .map(|(h, v)| (h - mean_h) * (v - mean))
        .sum::<f64>()
        / wide;
    let squares: f64 = values
        .iter()
        .map(|(h, v)| {
            let off = v - mean - slope * (h - mean_h);
            off * off
        })
        .sum();
    Some((slope, libm::sqrt(squares / (count - 2.0) / wide)))
}

/// When the values came to lie about where the last ones do.
fn settled(values: &[(f64, f64)]) -> Option<f64> {
    let count = values.len();
    let last = ((LAST * count as f64) as usize).max(3).min(count);
    let tail = values.get(count - last..)?;
    if let Some((slope, uncertainty)) = line(tail)
        && slope.abs() > SIGNIFICANT * uncertainty.max(f64::MIN_POSITIVE)
        && moved(values)
    {
        return None;
    }
    let mean = tail.iter().map(|(_, v)| v).sum::<f64>() / last as f64;
    // The scatter from value to value, which a drift has little part in (von Neumann 1941).
    let scatter = deviation(
        values
            .windows(2)
            .map(|pair| (pair[1].1 - pair[0].1) / core::f64::consts::SQRT_2),
    );
    let near = SETTLED * scatter;
    let unsettled = values.iter().rposition(|(_, v)| (v - mean).abs() > near);
    match unsettled {
        None => values.first().map(|(h, _)| *h),
        Some(index) => values.get(index + 1).map(|(h, _)| *h),
    }
}

/// Whether the values as a whole have a slope.
fn moved(values: &[(f64, f64)]) -> bool {
    line(values).is_some_and(|(slope, uncertainty)| slope.abs() > SIGNIFICANT * uncertainty)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise that is no noise: the same in each run.
    fn noise(k: usize) -> f64 {
        libm::sin(k as f64 * 78.233)
    }

    #[test]
    fn repeats_are_told_by_deviation_and_range() {
        let told = repeatability(&[1.0, 3.0, 2.0, 2.0]).unwrap();
        assert_eq!((told.mean, told.range, told.count), (2.0, 2.0, 4));
        assert!((told.standard_deviation - libm::sqrt(2.0 / 3.0)).abs() < 1e-15);
        assert_eq!(repeatability(&[1.0]), None);
    }

    #[test]
    fn a_warm_up_drifts_and_settles() {
        let values: Vec<(f64, f64)> = (0..40)
            .map(|k| {
                let h = k as f64 * 0.1;
                (
                    h,
                    80.0 + 0.05 * (1.0 - libm::exp(-h / 0.4)) + 0.0005 * noise(k),
                )
            })
            .collect();
        let told = drift(&values).unwrap();
        assert!(told.slope_per_h > 5.0 * told.uncertainty_per_h);
        let settled = told.settled_after_h.unwrap();
        assert!((1.0..2.4).contains(&settled), "{settled}");
    }

    #[test]
    fn a_steady_slope_is_told_with_its_uncertainty_and_never_settles() {
        let values: Vec<(f64, f64)> = (0..20)
            .map(|k| (k as f64 * 0.25, 0.02 * k as f64 * 0.25 + 0.001 * noise(k)))
            .collect();
        let told = drift(&values).unwrap();
        assert!((told.slope_per_h - 0.02).abs() < 3.0 * told.uncertainty_per_h);
        assert!(told.uncertainty_per_h < 0.0005);
        assert_eq!(told.settled_after_h, None);
    }

    #[test]
    fn what_does_not_drift_has_settled_at_once() {
        let values: Vec<(f64, f64)> = (0..12).map(|k| (k as f64, noise(k))).collect();
        let told = drift(&values).unwrap();
        assert!(told.slope_per_h.abs() < 3.0 * told.uncertainty_per_h);
        assert_eq!(told.settled_after_h, Some(0.0));
        assert_eq!(drift(&values[..4]), None);
    }
}
