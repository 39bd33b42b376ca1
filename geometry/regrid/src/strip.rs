//! A column as the regridder keeps it.

mod hidden;

use range_image::Column;

use crate::error::RegridError;
use crate::settings::{Estimator, RegridSettings};

/// Greatest coordinate accepted, millimetres. Scanners do not reach so far; a stray number
/// beyond would only make a grid that nobody wants to pay for.
pub(crate) const COORDINATE_LIMIT_MM: f64 = 25_000.0;

/// The samples of a column within the region of interest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Strip {
    pub(crate) x_mm: f64,
    /// y and z of the samples, by ascending y, then z.
    pub(crate) samples: Vec<(f64, f64)>,
}

impl Strip {
    /// The column cut to the region of interest, for consensus without the samples that lie
    /// beneath others; `index` is its place in the scan. The buffer is one to use again.
    pub(crate) fn new(
        column: &Column,
        settings: &RegridSettings,
        index: usize,
        buffer: Vec<(f64, f64)>,
    ) -> Result<Self, RegridError> {
        let roi = &settings.roi;
        let within = |value: f64, (low, high): (f64, f64)| low <= value && value <= high;
        let reachable = |value_mm: f64| {
            if value_mm.abs() <= COORDINATE_LIMIT_MM {
                Ok(())
            } else {
                Err(RegridError::TooFar {
                    index,
                    value_mm,
                    limit_mm: COORDINATE_LIMIT_MM,
                })
            }
        };
        let x_mm = column.x_mm();
        reachable(x_mm)?;
        let mut samples = buffer;
        samples.clear();
        if within(x_mm, roi.x_mm) {
            samples.reserve(column.samples().len());
            for sample in column.samples() {
                if within(sample.y_mm, roi.y_mm) && within(sample.z_mm, roi.z_mm) {
                    reachable(sample.y_mm)?;
                    reachable(sample.z_mm)?;
                    samples.push((sample.y_mm, sample.z_mm));
                }
            }
        }
        if settings.estimator == Estimator::Consensus {
            hidden::take_out(&mut samples);
        }
        Ok(Self { x_mm, samples })
    }

    /// Distances in y from a sample to the one below and the one above it; 0 where there is none.
    #[inline(always)]
    pub(crate) fn gaps(&self, index: usize) -> [f64; 2] {
        let y = |k: usize| self.samples.get(k).map(|s| s.0);
        let gap = |low: Option<f64>, high: Option<f64>| low.zip(high).map_or(0.0, |(l, h)| h - l);
        let (below, own) = (index.checked_sub(1).and_then(y), y(index));
        [gap(below, own), gap(own, y(index + 1))]
    }
}

/// The lower median, by selection; `None` of nothing. No number may be negative.
pub(crate) fn lower_median(values: &mut [f64]) -> Option<f64> {
    at_rank(values, values.len().checked_sub(1)? / 2)
}

/// The number than which so many are less, if there is one. No number may be negative: their bits
/// are in the same order then, and sooner compared.
pub(crate) fn at_rank(values: &mut [f64], rank: usize) -> Option<f64> {
    let by_bits = |a: &f64, b: &f64| a.to_bits().cmp(&b.to_bits());
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, by_bits).1)
}

/// Distances count up to this many times their median in [`typical`].
const DISTANCE_LIMIT: f64 = 4.0;

/// Typical distance: the mean, which follows the density where distances scatter or
/// samples have dropped out, but with each distance cut to a few times their median, since
/// the width of an occlusion gap says nothing of the density. Adds up in the order given
/// and a selection makes of it.
pub(crate) fn typical(distances: &mut [f64]) -> Option<f64> {
    let limit = DISTANCE_LIMIT * lower_median(distances)?;
    let sum: f64 = distances.iter().map(|distance| distance.min(limit)).sum();
    Some(sum / distances.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Roi;
    use range_image::Sample;

    #[test]
    fn typical_distances_ignore_the_width_of_gaps() {
        assert_eq!(typical(&mut [1.0, 1.0, 1.0, 3.0]), Some(1.5));
        assert_eq!(typical(&mut [1.0, 1.0, 1.0, 500.0]), Some(1.75));
        assert_eq!(typical(&mut []), None);
    }

    #[test]
    fn the_region_of_interest_cuts_on_all_sides() {
        let samples = (0..10).map(|k| Sample {
            y_mm: f64::from(k),
            z_mm: 10.0 * f64::from(k),
            intensity: 9,
        });
        let column = Column::new(5.0, samples.collect());
        let mut settings = RegridSettings::with_pitch(1.0);
        settings.roi = Roi {
            x_mm: (5.0, 6.0),
            y_mm: (2.0, 8.0),
            z_mm: (30.0, 65.0),
        };
        let strip = Strip::new(&column, &settings, 0, Vec::new()).unwrap();
        let heights: Vec<f64> = strip.samples.iter().map(|s| s.0).collect();
        assert_eq!(heights, [3.0, 4.0, 5.0, 6.0]);
        settings.roi.x_mm = (5.5, 6.0);
        assert!(
            Strip::new(&column, &settings, 0, vec![(0.0, 0.0)])
                .unwrap()
                .samples
                .is_empty()
        );
    }

    #[test]
    fn gaps_look_both_ways() {
        let strip = Strip {
            x_mm: 0.0,
            samples: vec![(0.0, 1.0), (1.0, 1.0), (1.0, 2.0), (4.0, 1.0)],
        };
        assert_eq!(strip.gaps(0), [0.0, 1.0]);
        assert_eq!(strip.gaps(1), [1.0, 0.0]);
        assert_eq!(strip.gaps(2), [0.0, 3.0]);
        assert_eq!(strip.gaps(3), [3.0, 0.0]);
    }
}
