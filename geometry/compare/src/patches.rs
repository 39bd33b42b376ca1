//! Local means of the samples' deviations, and which of them are significant.
//!
//! At a node the samples within a patch have a mean, in which near ones count more than far ones
//! (Epanechnikov's parabola) and by a redescending weight (Tukey's biweight about the median), so that outliers and torn spots have no part in it. Its standard
//! error follows from the samples' spread and number, and is made larger where neighbouring
//! samples err together: by how much is measured on the scan, as the robust spread of differences
//! of patches side by side against what independent samples would give.
//!
//! A deviation is told when a mean lies beyond a limit by more than `k` standard errors, with
//! `k` after Bonferroni from the number of means that are looked at: the probability that
//! anything is told of a part that meets the limits is then at most the false-alarm probability,
//! as far as means of dozens of samples are normally distributed.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::deviation::{NodeState, Residuals};
use crate::normal::{MAD_TO_SIGMA, biweight, median, scale_about_zero, two_sided_quantile};

/// Patches are averaged at this many sizes, each twice as wide as the one before.
pub(crate) const SIZES: usize = 4;
/// Sizes up to this one have a mean at every node; wider ones overlap enough with fewer.
pub(crate) const DENSE: usize = 2;
/// A mean of fewer samples says nothing.
const LEAST_SAMPLES: usize = 8;
/// A mean that fewer of its samples agree with is none.
const LEAST_AGREEMENT: f64 = 0.5;
/// The biweight's mean needs so many more samples than the plain mean for the same error.
const EFFICIENCY: f64 = 0.95;

/// A local mean.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mean {
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) mean_mm: f64,
    /// Standard error as from independent samples at first, then as it is.
    pub(crate) error_mm: f64,
    spread_mm: f64,
    samples: f64,
}

/// The local means of one size.
#[derive(Debug, Clone)]
pub(crate) struct Patches {
    pub(crate) radius_mm: f64,
    pub(crate) means: Vec<Mean>,
    /// How much larger the means' errors are than those of independent samples.
    pub(crate) inflation: f64,
}

/// How significance was decided.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// Limits beyond which deviations are told, millimetres.
    pub lower_mm: f64,
    /// The upper of them.
    pub upper_mm: f64,
    /// A mean must lie beyond a limit by this many of its standard errors.
    pub standard_errors: f64,
    /// Local means looked at.
    pub means: usize,
    /// Probability of a false alarm on the whole scan, at most.
    pub false_alarm: f64,
    /// The sizes of patches.
    pub patches: Vec<PatchSize>,
}

/// What local means of one size are worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchSize {
    /// Diameter of the patch, millimetres.
    pub diameter_mm: f64,
    /// Means of this size.
    pub means: usize,
    /// Median of their standard errors, millimetres.
    pub standard_error_mm: f64,
    /// How much larger they are than those of independent samples.
    pub inflation: f64,
    /// The deviation beyond a limit that is told for sure to one half: `k` standard errors.
    pub told_mm: f64,
}

/// The local means of every size, the smallest first, with their errors.
pub(crate) fn patches(
    residuals: &Residuals,
    states: &[NodeState],
    pitch_mm: f64,
    (smallest_mm, noise_mm): (f64, f64),
    monitor: &dyn Monitor,
) -> Result<Vec<Patches>, Cancelled> {
    let mut all = Vec::with_capacity(SIZES);
    for size in 0..SIZES {
        let radius_mm = smallest_mm / 2.0 * f64::from(1 << size);
        let radius = radius_mm / pitch_mm;
        let stride = if size < DENSE {
            1
        } else {
            (radius / 4.0).floor().max(1.0) as usize
        };
        let means = means(residuals, states, (radius, stride), noise_mm, monitor)?;
        let apart = (2.0 * radius / stride as f64).ceil().max(1.0) as usize * stride;
        let mut patches = Patches {
            radius_mm,
            inflation: 1.0,
            means,
        };
        patches.judge(residuals, apart);
        all.push(patches);
    }
    Ok(all)
}

fn means(
    residuals: &Residuals,
    states: &[NodeState],
    (radius, stride): (f64, usize),
    noise_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Mean>, Cancelled> {
    let columns: Vec<usize> = (0..residuals.columns).step_by(stride).collect();
    let found: Result<Vec<Vec<Mean>>, Cancelled> = columns
        .into_par_iter()
        .map(|column| {
            monitor.check()?;
            let (mut near, mut room) = (Vec::new(), Vec::new());
            let mut means = Vec::new();
            for row in (0..residuals.rows).step_by(stride) {
                let state = states.get(column * residuals.rows + row);
                if !matches!(state, Some(NodeState::Compared(_))) {
                    continue;
                }
                residuals.around(column, row, radius, &mut near);
                means.extend(mean(&near, noise_mm, &mut room).map(
                    |(mean_mm, spread_mm, samples)| Mean {
                        column,
                        row,
                        mean_mm,
                        spread_mm,
                        samples,
                        error_mm: f64::NAN,
                    },
                ));
            }
            Ok(means)
        })
        .collect();
    Ok(found?.into_iter().flatten().collect())
}

/// Robust mean, robust standard deviation, and how many samples the mean is worth, of values with
/// weights.
///
/// Values are told apart in units of their own spread, but of `noise_mm` at least: where a scanner's
/// counts are as coarse as its noise most samples of a patch may be equal, and the others, at the
/// next count, are no outliers.
fn mean(values: &[[f64; 2]], noise_mm: f64, room: &mut Vec<f64>) -> Option<(f64, f64, f64)> {
    if values.len() < LEAST_SAMPLES {
        return None;
    }
    // The inner half of the patch tells where its middle is.
    room.clear();
    room.extend(
        values
            .iter()
            .filter(|[_, weight]| *weight >= 0.5)
            .map(|[value, _]| value),
    );
    if room.len() < LEAST_SAMPLES / 2 {
        return None;
    }
    let middle = median(room);
    room.clear();
    room.extend(values.iter().map(|[value, _]| (value - middle).abs()));
    // Exact data have no spread; a picometre keeps the errors above nothing.
    let spread = (MAD_TO_SIGMA * median(room)).max(1e-9);
    let unit = spread.max(noise_mm);
    let mut mean = middle;
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..4 {
        let mut moment = 0.0;
        (sum, squares) = (0.0, 0.0);
        for [value, share] in values {
            let weight = share * biweight((value - mean) / unit);
            sum += weight;
            squares += weight * weight;
            moment += weight * value;
        }
        if sum <= 0.0 {
            return None;
        }
        mean = moment / sum;
    }
    let all: f64 = values.iter().map(|[_, share]| share).sum();
    if sum < LEAST_AGREEMENT * all {
        return None;
    }
    Some((mean, spread, EFFICIENCY * sum * sum / squares))
}

impl Patches {
    /// Gives each mean its standard error.
    fn judge(&mut self, residuals: &Residuals, apart: usize) {
        let mut spreads: Vec<f64> = self.means.iter().map(|mean| mean.spread_mm).collect();
        let usual_mm = median(&mut spreads);
        for mean in &mut self.means {
            // A patch that happens to look quiet is no better than others.
            mean.error_mm = mean.spread_mm.max(usual_mm) / mean.samples.sqrt();
        }
        let rows = residuals.rows;
        let mut places = vec![usize::MAX; residuals.columns * rows];
        for (index, mean) in self.means.iter().enumerate() {
            if let Some(place) = places.get_mut(mean.column * rows + mean.row) {
                *place = index;
            }
        }
        let at = |column: usize, row: usize| {
            let place = (row < rows).then(|| places.get(column * rows + row))??;
            self.means.get(*place)
        };
        // Slow changes of the form cancel in differences; what is left is noise.
        let differences = self.means.iter().flat_map(|mean| {
            [
                at(mean.column + apart, mean.row),
                at(mean.column, mean.row + apart),
            ]
            .into_iter()
            .flatten()
            .map(|other| {
                let error = mean.error_mm * mean.error_mm + other.error_mm * other.error_mm;
                (mean.mean_mm - other.mean_mm) / error.sqrt()
            })
        });
        let found = scale_about_zero(differences);
        self.inflation = if found.is_finite() {
            found.max(1.0)
        } else {
            1.0
        };
        for mean in &mut self.means {
            mean.error_mm *= self.inflation;
        }
    }

    fn usual_error_mm(&self) -> f64 {
        let mut errors: Vec<f64> = self.means.iter().map(|mean| mean.error_mm).collect();
        median(&mut errors)
    }
}

/// How significance is decided with these means.
pub(crate) fn decision(
    all: &[Patches],
    (lower_mm, upper_mm): (f64, f64),
    false_alarm: f64,
) -> Decision {
    let means = all.iter().map(|patches| patches.means.len()).sum::<usize>();
    let standard_errors = two_sided_quantile(false_alarm / means.max(1) as f64);
    let sizes = all.iter().filter(|patches| !patches.means.is_empty());
    Decision {
        lower_mm,
        upper_mm,
        standard_errors,
        means,
        false_alarm,
        patches: sizes
            .map(|patches| PatchSize {
                diameter_mm: 2.0 * patches.radius_mm,
                means: patches.means.len(),
                standard_error_mm: patches.usual_error_mm(),
                inflation: patches.inflation,
                told_mm: standard_errors * patches.usual_error_mm(),
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_withstands_outliers_and_states_its_samples() {
        let mut values: Vec<[f64; 2]> = (0..40)
            .map(|i| [f64::from(i % 5) * 0.01 - 0.02, 1.0])
            .collect();
        let mut room = Vec::new();
        let (clean, spread, samples) = mean(&values, 0.01, &mut room).unwrap();
        assert!(
            clean.abs() < 1e-12 && spread > 0.01 && samples > 35.0,
            "{samples}"
        );
        values.extend([1.5, -1.9, 1.2, 1.8].map(|outlier| [outlier, 1.0]));
        let (with, _, _) = mean(&values, 0.01, &mut room).unwrap();
        assert!(with.abs() < 0.002, "{with}");
        assert!(mean(&values[..7], 0.01, &mut room).is_none());
        let (exact, _, _) = mean(&[[0.25, 1.0]; 9], 1e-6, &mut room).unwrap();
        assert!((exact - 0.25).abs() < 1e-15);
    }

    #[test]
    fn counts_as_coarse_as_the_noise_do_not_pull_a_mean() {
        // 0.03 mm between counts of 0.1 mm: seven in ten are at 0.
        let values: Vec<[f64; 2]> = (0..60)
            .map(|i| [if i % 10 < 7 { 0.0 } else { 0.1 }, 1.0])
            .collect();
        let (found, _, _) = mean(&values, 0.06, &mut Vec::new()).unwrap();
        assert!((found - 0.03).abs() < 0.006, "{found}");
    }
}
