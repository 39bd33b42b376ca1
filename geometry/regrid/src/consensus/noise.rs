//! The noise of a scan, from the scan itself.

use crate::strip::Strip;

/// Shares of the second differences, the smallest ones, that the search for the noise begins
/// with. At 45 % outliers a sixth of them is free of any. Of coarse depths as many may be
/// next to nothing, though all are noise; then the search begins anew with more.
const FIRST_SHARES: [f64; 6] = [0.08, 0.12, 0.18, 0.27, 0.4, 0.6];
/// Standard deviations within which a difference is taken for noise.
const WIDTH: f64 = 2.5;
/// Share of a normal distribution within that width, and its variance in there.
const WITHIN: f64 = 0.987_58;
const VARIANCE_WITHIN: f64 = 0.9113;
/// Where so many others, of the differences taken for noise, lie close together, those are one
/// step of the resolution among others.
const OTHER_STEP: f64 = 0.15;
/// Spread of the differences that the next step shows, of the step.
const STEP_SPREAD: f64 = 0.2;
/// Fewest differences that make such a step.
const LEAST_STEP: usize = 4;
/// Quantile of the differences that are not zero below which lies the resolution of z.
const RESOLUTION_QUANTILE: f64 = 0.05;
/// Standard deviation of the rounding to a resolution of 1, of which second differences
/// show half steps.
const ROUNDING: f64 = 0.58;
/// Share of the differences next to nothing from which on depths do come in steps, if those
/// next to nothing are so small a part of a step: in steps nothing lies between.
const IN_STEPS: f64 = 0.08;
const GAP: f64 = 0.25;
/// Share of the differences of a step or more, below which they are those of edges, as in a scan
/// that was computed and has no noise.
const STEPS: f64 = 0.2;
/// Fewest differences that tell something.
const LEAST: usize = 24;

/// Standard deviations beyond which a difference is one of outliers or of the edge of a face: where
/// samples are sparse, what bends differs by more than noise, but hardly by so much.
const FAR: f64 = 10.0;

/// Share of clean samples below which no estimate is believed.
const LEAST_CLEAN: f64 = 0.5;

/// What the samples of some columns tell of their noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    /// Standard deviation of z, millimetres.
    pub(crate) deviation_mm: f64,
    /// The part of it that comes of depths in steps wider than the noise, millimetres.
    pub(crate) rounding_mm: f64,
    /// About which share of the samples is free of outliers: the cube root of the share of
    /// differences that are, each made of three samples.
    pub(crate) clean_share: f64,
    /// The same, but with what is not far off counted as clean, whether noise or not.
    pub(crate) ordinary_share: f64,
}

/// Standard deviation of z within these columns, millimetres; `None` where there are too
/// few samples to tell.
///
/// A sample's distance from the line through the samples below and above it in its column
/// is noise, where none of the three is an outlier and the surface is smooth there. The
/// least of these distances are noise alone, and with a normal distribution they tell the
/// standard deviation of all that are: of the `k` smallest out of `n` distances that are
/// noise, the greatest is the `k / n` quantile. `n` follows from the deviation, and so in
/// turns. The variance of all that are noise then gives the deviation its final value.
pub(crate) fn noise<'a>(
    strips: impl Iterator<Item = &'a Strip>,
    scratch: &mut Vec<f64>,
) -> Option<Noise> {
    scratch.clear();
    for strip in strips {
        scratch.extend(strip.samples.windows(3).filter_map(|three| {
            let [(y0, z0), (y1, z1), (y2, z2)] = [three[0], three[1], three[2]];
            let upper = (y1 - y0) / (y2 - y0);
            // Of very uneven distances the noise would come out too small or too large.
            if !(0.1..=0.9).contains(&upper) {
                return None;
            }
            let lower = 1.0 - upper;
            let deviation = z1 - (lower * z0 + upper * z2);
            let gain2 = 1.0 + lower * lower + upper * upper;
            Some(deviation.abs() / gain2.sqrt())
        }));
    }
    let number = scratch.len();
    if number < LEAST {
        return None;
    }
    scratch.sort_unstable_by(f64::total_cmp);

    let mut zero_mm = 1e-9;
    let mut deviation_mm = 0.0;
    for share in FIRST_SHARES {
        let first = ((share * number as f64) as usize).max(LEAST / 4);
        deviation_mm = variance_within(scratch, quantile_within(scratch, first));
        if !is_step(scratch, deviation_mm) {
            break;
        }
        zero_mm = (WIDTH * deviation_mm).max(zero_mm);
    }
    let zeros = scratch.partition_point(|d| *d <= zero_mm);
    let step = (zeros as f64 + RESOLUTION_QUANTILE * (number - zeros) as f64) as usize;
    let step_mm = scratch.get(step).copied().unwrap_or(0.0);
    let deviation_mm = deviation_mm.max(ROUNDING * step_mm);
    let share = |count: usize| count as f64 / number as f64;
    let often = share(zeros) >= IN_STEPS && share(number - zeros) >= STEPS;
    let in_steps = often && zero_mm <= GAP * step_mm;
    let rounding_mm = if in_steps { ROUNDING * step_mm } else { 0.0 };
    // Three samples make each difference.
    let share_within = |width: f64, held: f64| {
        let within = scratch.partition_point(|d| *d <= width * deviation_mm);
        libm::cbrt(share(within) / held).clamp(LEAST_CLEAN, 1.0)
    };
    Some(Noise {
        deviation_mm,
        rounding_mm,
        clean_share: share_within(WIDTH, WITHIN),
        ordinary_share: share_within(FAR, 1.0),
    })
}

/// The deviation of which the `first` smallest distances, in ascending order, tell.
fn quantile_within(distances: &[f64], first: usize) -> f64 {
    let smallest = distances.get(first).copied().unwrap_or(0.0);
    let mut clean = distances.len();
    let mut deviation = 0.0;
    // Fewer are noise with every turn, and so the deviation grows, until it is consistent.
    for _ in 0..40 {
        let share = (first as f64 / clean as f64).min(0.95);
        deviation = smallest / half_normal_quantile(share);
        let within = distances.partition_point(|d| *d <= WIDTH * deviation);
        let within = within.max(first + 1);
        if within >= clean {
            break;
        }
        clean = within;
    }
    deviation
}

/// The deviation whose normal distribution, cut off at [`WIDTH`], has the variance of the
/// distances up to there; sought from the one given.
fn variance_within(distances: &[f64], mut deviation: f64) -> f64 {
    for _ in 0..10 {
        let within = distances.partition_point(|d| *d <= WIDTH * deviation);
        let squares: f64 = distances[..within].iter().map(|d| d * d).sum();
        let next = (squares / within.max(1) as f64 / VARIANCE_WITHIN).sqrt();
        if (next - deviation).abs() <= 1e-3 * deviation {
            return next;
        }
        deviation = next;
    }
    deviation
}

/// Whether what seems noise is one step of the resolution: others lie as close together, or
/// come next and lie about the next step, which slopes and uneven distances spread. Outliers
/// scatter far more.
fn is_step(distances: &[f64], deviation: f64) -> bool {
    let (end, length) = (WIDTH * deviation, 2.0 * WIDTH * deviation);
    let within = distances.partition_point(|d| *d <= end);
    let beyond = distances.get(within..).unwrap_or_default();
    let number = ((OTHER_STEP * within as f64) as usize).max(LEAST_STEP);
    beyond.windows(number).enumerate().any(|(before, some)| {
        let spread = some[number - 1] - some[0];
        spread <= length || before <= number && spread <= STEP_SPREAD * some[0]
    })
}

/// Quantile of the absolute value of a standard normal variable.
fn half_normal_quantile(share: f64) -> f64 {
    // Bisection of erf: exact to the last bits on every machine, and called rarely.
    let (mut low, mut high) = (0.0, 4.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if libm::erf(middle * core::f64::consts::FRAC_1_SQRT_2) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of a tilted plane with normal noise, outliers, and depths in whole steps
    /// along a beam that leans, so that no two distances are quite the same.
    fn strips(noise_mm: f64, step_mm: f64, outliers: f64) -> Vec<Strip> {
        let mut state = 5_u64;
        let mut uniform = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let column = |k: u32| {
            let samples = (0..200).map(|row| {
                let y_mm = 0.4 * f64::from(row) + 0.05 * uniform();
                let normal: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let mut range_mm = 300.0 + 0.3 * y_mm + noise_mm * normal;
                if uniform() < outliers {
                    range_mm += 60.0 * (uniform() - 0.5);
                }
                if step_mm > 0.0 {
                    range_mm = step_mm * (range_mm / step_mm).round();
                }
                (y_mm, range_mm * libm::cos(1e-3 * y_mm))
            });
            Strip {
                x_mm: f64::from(k),
                samples: samples.collect(),
            }
        };
        (0..17).map(column).collect()
    }

    #[test]
    fn the_noise_is_found_among_outliers() {
        for outliers in [0.0, 0.1, 0.3, 0.45] {
            let strips = strips(0.05, 0.0, outliers);
            let found = noise(strips.iter(), &mut Vec::new()).unwrap();
            let ratio = found.deviation_mm / 0.05;
            assert!((0.9..1.15).contains(&ratio), "{outliers}: {found:?}");
            let clean = found.clean_share / (1.0 - outliers);
            assert!((0.93..1.07).contains(&clean), "{outliers}: {found:?}");
        }
    }

    /// Of depths in steps of twice the noise a sixth of the differences is next to nothing.
    #[test]
    fn coarse_depths_are_not_taken_for_exact_ones() {
        for step_mm in [0.05, 0.1, 0.15] {
            let variance = 0.05 * 0.05 + step_mm * step_mm / 12.0;
            for outliers in [0.0, 0.1, 0.3] {
                let strips = strips(0.05, step_mm, outliers);
                let found = noise(strips.iter(), &mut Vec::new()).unwrap();
                let ratio = found.deviation_mm / variance.sqrt();
                let case = format!("{step_mm} {outliers}: {found:?}");
                assert!((0.8..1.3).contains(&ratio), "{case}");
                let clean = found.clean_share / (1.0 - outliers);
                assert!((0.85..1.15).contains(&clean), "{case}");
            }
        }
    }

    /// Of far coarser ones whole terraces agree, and what differs does so by one step.
    #[test]
    fn terraces_are_not_taken_for_exact_depths() {
        for outliers in [0.0, 0.1] {
            let strips = strips(0.005, 0.35, outliers);
            let found = noise(strips.iter(), &mut Vec::new()).unwrap();
            let ratio = found.deviation_mm / (0.35 / 12_f64.sqrt());
            assert!((0.8..1.5).contains(&ratio), "{outliers}: {found:?}");
            let rounding = found.rounding_mm / (0.35 / 12_f64.sqrt());
            assert!((0.7..1.5).contains(&rounding), "{outliers}: {found:?}");
        }
    }

    /// On something crumpled differences of all sizes come close together, like one step or many.
    #[test]
    fn what_is_crumpled_is_not_in_steps() {
        let mut strips = strips(0.001, 0.0, 0.0);
        for (k, strip) in strips.iter_mut().enumerate() {
            for (row, sample) in strip.samples.iter_mut().enumerate() {
                let turned = ((k * 200 + row) as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let stray = (turned >> 40) as f64 / f64::from(1 << 24);
                sample.1 += libm::pow(10.0, 5.0 * stray - 4.5);
            }
        }
        let found = noise(strips.iter(), &mut Vec::new()).unwrap();
        assert!(found.rounding_mm < 0.05, "{found:?}");
    }

    /// What bends between sparse samples is off the noise, but not far, as outliers are.
    #[test]
    fn bends_are_ordinary_and_outliers_are_not() {
        let mut bent = strips(0.05, 0.0, 0.0);
        for (row, sample) in bent
            .iter_mut()
            .flat_map(|s| s.samples.iter_mut().enumerate())
        {
            sample.1 += if row % 10 == 0 { 0.5 } else { 0.0 };
        }
        let bent = noise(bent.iter(), &mut Vec::new()).unwrap();
        assert!(bent.clean_share < 0.95, "{bent:?}");
        assert!(bent.ordinary_share > 0.99, "{bent:?}");
        let among = noise(strips(0.05, 0.0, 0.1).iter(), &mut Vec::new()).unwrap();
        assert!((among.ordinary_share - 0.9).abs() < 0.02, "{among:?}");
    }

    /// Without noise nothing but the edges differs.
    #[test]
    fn edges_are_not_steps_of_depth() {
        let mut strips = strips(0.0, 0.0, 0.0);
        for sample in strips.iter_mut().flat_map(|strip| &mut strip.samples) {
            sample.1 = if sample.0 < 40.0 { 0.0 } else { 12.0 };
        }
        let found = noise(strips.iter(), &mut Vec::new()).unwrap();
        assert!(found.rounding_mm <= 0.0, "{found:?}");
    }

    #[test]
    fn fine_depths_are_hardly_rounded() {
        let found = noise(strips(0.05, 0.001, 0.1).iter(), &mut Vec::new()).unwrap();
        assert!(found.rounding_mm <= 0.0, "{found:?}");
    }

    #[test]
    fn few_samples_tell_nothing() {
        let mut strips = strips(0.05, 0.0, 0.0);
        strips.truncate(1);
        strips[0].samples.truncate(LEAST + 1);
        assert!(noise(strips.iter(), &mut Vec::new()).is_none());
    }
}
