//! Deviations in numbers.

/// Deviations of all nodes compared, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Mean.
    pub mean_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
    /// Standard deviation about the mean.
    pub standard_deviation_mm: f64,
    /// Least.
    pub min_mm: f64,
    /// Greatest.
    pub max_mm: f64,
    /// The size that 95 % do not exceed.
    pub percentile_95_mm: f64,
}

/// How often deviations of which size occur.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Limits of the bins, ascending; one more than there are bins. The middle bin lies about 0.
    pub limits_mm: Vec<f64>,
    /// Nodes in each bin, its lower limit included.
    pub counts: Vec<usize>,
    /// Nodes below the first limit.
    pub below: usize,
    /// Nodes at or above the last.
    pub above: usize,
}

/// Bins on either side of the middle one.
const BINS: usize = 20;

/// `None` of nothing.
pub(crate) fn statistics(deviations_mm: &[f64]) -> Option<Statistics> {
    if deviations_mm.is_empty() {
        return None;
    }
    let count = deviations_mm.len() as f64;
    let mean_mm = deviations_mm.iter().sum::<f64>() / count;
    let squares = |about: f64| {
        deviations_mm
            .iter()
            .map(|d| (d - about) * (d - about))
            .sum::<f64>()
    };
    let mut sizes: Vec<f64> = deviations_mm.iter().map(|d| d.abs()).collect();
    Some(Statistics {
        mean_mm,
        rms_mm: (squares(0.0) / count).sqrt(),
        standard_deviation_mm: (squares(mean_mm) / (count - 1.0).max(1.0)).sqrt(),
        min_mm: deviations_mm.iter().copied().fold(f64::INFINITY, f64::min),
        max_mm: deviations_mm
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max),
        percentile_95_mm: percentile(&mut sizes, 0.95),
    })
}

/// The least value that this share of all does not exceed.
fn percentile(values: &mut [f64], share: f64) -> f64 {
    let rank = (values.len() as f64 * share).ceil() as usize;
    let index = rank.clamp(1, values.len().max(1)) - 1;
    if index >= values.len() {
        return f64::NAN;
    }
    *values.select_nth_unstable_by(index, f64::total_cmp).1
}

/// Bins that hold 99.5 % of the values, and reach at least as far as `least_mm`.
pub(crate) fn histogram(deviations_mm: &[f64], least_mm: f64) -> Histogram {
    let mut sizes: Vec<f64> = deviations_mm.iter().map(|d| d.abs()).collect();
    let most = percentile(&mut sizes, 0.995);
    let reach = if most.is_finite() { most } else { 0.0 }
        .max(least_mm)
        .max(1e-6);
    let width = round_up(reach / (BINS as f64 + 0.5));
    let limits_mm: Vec<f64> = (0..=2 * BINS + 1)
        .map(|index| (index as f64 - BINS as f64 - 0.5) * width)
        .collect();
    let mut histogram = Histogram {
        counts: vec![0; 2 * BINS + 1],
        below: 0,
        above: 0,
        limits_mm,
    };
    for deviation in deviations_mm {
        let behind = histogram
            .limits_mm
            .partition_point(|limit| limit <= deviation);
        match behind.checked_sub(1) {
            None => histogram.below += 1,
            Some(bin) => match histogram.counts.get_mut(bin) {
                Some(count) => *count += 1,
                None => histogram.above += 1,
            },
        }
    }
    histogram
}

/// The next 1, 2, 2.5 or 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = libm::pow(10.0, libm::floor(libm::log10(value)));
    let steps = [1.0, 2.0, 2.5, 5.0];
    let step = steps
        .into_iter()
        .find(|step| step * decade >= value * (1.0 - 1e-12));
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_a_few_numbers() {
        let found = statistics(&[1.0, -1.0, 3.0, 1.0]).unwrap();
        assert_eq!(
            (found.mean_mm, found.min_mm, found.max_mm),
            (1.0, -1.0, 3.0)
        );
        assert_eq!(
            (found.rms_mm, found.percentile_95_mm),
            (3.0_f64.sqrt(), 3.0)
        );
        assert!((found.standard_deviation_mm - (8.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!(statistics(&[]).is_none());
    }

    #[test]
    fn bins_lie_about_zero_and_lose_nothing() {
        let values: Vec<f64> = (-100..=100).map(|i| f64::from(i) * 0.01).collect();
        let bins = histogram(&values, 0.0);
        assert_eq!(bins.limits_mm.len(), bins.counts.len() + 1);
        let all = bins.counts.iter().sum::<usize>() + bins.below + bins.above;
        assert_eq!(all, values.len());
        assert!((bins.limits_mm[20] + bins.limits_mm[21]).abs() < 1e-12);
        let few = histogram(&[-5.0, 0.0, 0.0, 7.0], 0.1);
        assert_eq!(few.counts.iter().sum::<usize>(), 4);
        assert_eq!(histogram(&[], 0.1).counts.iter().sum::<usize>(), 0);
    }
}
