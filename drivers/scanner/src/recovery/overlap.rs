//! Whether a column measured again is the one measured before: the proof that neither the
//! table nor the object has moved in between.
//!
//! The noise is taken from the columns themselves, by the differences of second order along
//! them, whose median edges and outliers do not reach (Rousseeuw & Croux 1993 on the median
//! absolute deviation).

use std::collections::VecDeque;

use crate::limits::{MAX_OVERLAP, PROOF_SAMPLES};
use crate::scanner::{RawColumn, RawSample};

/// Samples that the columns measured again should have together.
const ENOUGH: usize = 64;

/// What a few samples may lie off, counts.
const FEW_COUNTS: f64 = 5.0;

/// Share of samples that must be in both.
const COMMON: f64 = 0.75;

/// Share of samples that may lie apart, besides outliers.
const APART: f64 = 0.2;

/// A single pair lies apart beyond so many standard deviations.
const PAIR_SIGMAS: f64 = 6.0;

/// The mean lies apart beyond so many of its standard deviations.
const MEAN_SIGMAS: f64 = 5.0;

/// What a sound table may miss when it has been homed anew, millimetres.
const HOMING_MM: f64 = 0.02;

/// From a median absolute deviation to a standard deviation, for normal noise.
const MAD_TO_SIGMA: f64 = 1.4826;

/// The columns handed on that are measured again for a comparison.
#[derive(Debug, Clone, Default)]
pub(super) struct Kept {
    columns: VecDeque<RawColumn>,
    /// The first so many are from before a gap in the object: the last that could prove
    /// anything. The others are the last of all.
    before_gap: usize,
}

impl Kept {
    /// Adds the next column, and drops what is not needed any more. Of the last ones at least
    /// `fewest` stay.
    pub(super) fn push(&mut self, column: RawColumn, fewest: u16) {
        self.columns.push_back(column);
        if self.samples_from(self.before_gap) >= PROOF_SAMPLES {
            self.columns.drain(..self.before_gap);
            self.before_gap = 0;
        }
        loop {
            let first = self.before_gap;
            let last_ones = self.columns.len() - first;
            let rest = self.samples_from(first + 1);
            if last_ones <= usize::from(MAX_OVERLAP)
                && (last_ones <= usize::from(fewest) || rest < ENOUGH)
            {
                break;
            }
            if first == 0 && rest < PROOF_SAMPLES && self.samples_from(0) >= PROOF_SAMPLES {
                self.before_gap = self.columns.len();
                break;
            }
            self.columns.remove(first);
        }
    }

    /// Where the measuring has to begin again, unless nothing has been handed on.
    pub(super) fn first_index(&self) -> Option<u32> {
        self.columns.front().map(|column| column.index)
    }

    /// Whether it is one of them.
    pub(super) fn has(&self, index: u32) -> bool {
        self.columns.iter().any(|column| column.index == index)
    }

    /// All, in order.
    pub(super) fn iter(&self) -> impl Iterator<Item = &RawColumn> {
        self.columns.iter()
    }

    /// All, in order.
    pub(super) fn into_columns(self) -> impl Iterator<Item = RawColumn> {
        self.columns.into_iter()
    }

    fn samples_from(&self, first: usize) -> usize {
        let columns = self.columns.iter().skip(first);
        columns.map(|column| column.samples.len()).sum()
    }
}

/// Compares columns with their measurements of before; `count_mm` is a count of range or
/// depth. Columns that are not in both do not matter.
///
/// # Errors
/// In words, with figures, how they differ.
pub(super) fn compare<'a>(
    before: impl IntoIterator<Item = &'a RawColumn>,
    again: &[RawColumn],
    count_mm: f64,
) -> Result<(), String> {
    let mut evidence = Evidence::default();
    for kept in before {
        if let Some(column) = again.iter().find(|column| column.index == kept.index) {
            evidence.add(&sorted(kept), &sorted(column));
        }
    }
    evidence.judge(count_mm)
}

/// What the columns have to say together.
#[derive(Debug, Default)]
struct Evidence {
    most: usize,
    /// Differences in range, counts.
    off: Vec<f64>,
    /// Differences of second order along the columns, counts.
    bends: Vec<f64>,
}

impl Evidence {
    fn add(&mut self, before: &[RawSample], again: &[RawSample]) {
        self.most += before.len().max(again.len());
        self.off.extend(pairs(before, again));
        self.bends.extend(bends(before));
        self.bends.extend(bends(again));
    }

    fn judge(mut self, count_mm: f64) -> Result<(), String> {
        let (most, common) = (self.most, self.off.len());
        if (common as f64) < COMMON * most as f64 - 1.0 {
            return Err(format!(
                "only {common} of {most} samples come back in the same places"
            ));
        }
        if common == 0 {
            return Ok(());
        }
        let (sigma, rough) = noise(&mut self.bends);
        // Rounding to counts is noise as well.
        let sigma = (2.0 * (sigma * sigma + 1.0 / 12.0)).sqrt();
        self.off.sort_by(f64::total_cmp);
        // Where a column bends a lot, the differences themselves know more about the noise: a
        // shift does not make them scatter.
        let scatter = scatter(&self.off).min(sigma).max((1.0_f64 / 6.0).sqrt());
        let floor = 0.5_f64.max(HOMING_MM / count_mm);
        let bound = (PAIR_SIGMAS * sigma).max(floor);
        let (mean, tolerance) = if common < PROOF_SAMPLES {
            (
                self.off[common / 2],
                (PAIR_SIGMAS * scatter).max(FEW_COUNTS),
            )
        } else {
            let tolerance = MEAN_SIGMAS * scatter / (common as f64).sqrt();
            (trimmed_mean(&self.off), tolerance.max(floor))
        };
        if mean.abs() > tolerance {
            return Err(format!(
                "it lies {:.3} mm off, of which at most {:.3} mm can be noise",
                mean * count_mm,
                tolerance * count_mm
            ));
        }
        let apart = self.off.iter().filter(|off| off.abs() > bound).count();
        let allowed = (APART + 2.0 * rough) * common as f64;
        if common >= PROOF_SAMPLES && apart as f64 > allowed {
            return Err(format!(
                "{apart} of {common} samples lie more than {:.3} mm off, of which {allowed:.0} can \
                 be outliers",
                bound * count_mm,
            ));
        }
        Ok(())
    }
}

fn sorted(column: &RawColumn) -> Vec<RawSample> {
    let mut samples = column.samples.clone();
    samples.sort_by_key(|sample| sample.lateral_counts);
    samples
}

/// Differences in range of samples at the same lateral, give or take half a step.
fn pairs(before: &[RawSample], again: &[RawSample]) -> Vec<f64> {
    let mut steps: Vec<i64> = before
        .windows(2)
        .map(|pair| apart(&pair[0], &pair[1]))
        .collect();
    steps.sort_unstable();
    let half = steps.get(steps.len() / 2).copied().unwrap_or(0) / 2;
    let mut rest = again.iter().peekable();
    let mut found = Vec::with_capacity(before.len());
    for sample in before {
        while rest
            .next_if(|other| {
                other.lateral_counts < sample.lateral_counts && apart(other, sample) > half
            })
            .is_some()
        {}
        if let Some(other) = rest.next_if(|other| apart(other, sample) <= half) {
            found.push(f64::from(other.range_counts) - f64::from(sample.range_counts));
        }
    }
    found
}

fn apart(one: &RawSample, other: &RawSample) -> i64 {
    (i64::from(one.lateral_counts) - i64::from(other.lateral_counts)).abs()
}

/// Differences of second order of the ranges along a column, counts.
fn bends(samples: &[RawSample]) -> impl Iterator<Item = f64> + '_ {
    samples.windows(3).map(|three| {
        let range = |i: usize| f64::from(three[i].range_counts);
        (range(0) - 2.0 * range(1) + range(2)).abs()
    })
}

/// Standard deviation of the ranges, counts, and the share of samples far beyond it.
fn noise(bends: &mut [f64]) -> (f64, f64) {
    if bends.is_empty() {
        return (0.0, 0.0);
    }
    bends.sort_by(f64::total_cmp);
    // The weights 1, -2, 1 make six variances of one.
    let sigma = MAD_TO_SIGMA * bends[bends.len() / 2] / 6.0_f64.sqrt();
    let bound = PAIR_SIGMAS * (6.0 * (sigma * sigma + 1.0 / 12.0)).sqrt();
    let far = bends.iter().filter(|bend| **bend > bound).count();
    // One outlier bends three places.
    (sigma, far as f64 / 3.0 / bends.len() as f64)
}

/// Standard deviation of sorted values about their median.
fn scatter(sorted: &[f64]) -> f64 {
    let Some(median) = sorted.get(sorted.len() / 2) else {
        return 0.0;
    };
    let mut apart: Vec<f64> = sorted.iter().map(|value| (value - median).abs()).collect();
    apart.sort_by(f64::total_cmp);
    MAD_TO_SIGMA * apart[apart.len() / 2]
}

/// The mean without the tenth at either end.
fn trimmed_mean(sorted: &[f64]) -> f64 {
    let cut = sorted.len() / 10;
    let middle = sorted.get(cut..sorted.len() - cut).unwrap_or(sorted);
    middle.iter().sum::<f64>() / middle.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare(before: &RawColumn, again: &RawColumn, count_mm: f64) -> Result<(), String> {
        super::compare([before], std::slice::from_ref(again), count_mm)
    }

    const COUNT_MM: f64 = 0.01;

    /// A tilted column with a step, with noise of about 5 counts from a seed.
    fn column(seed: u64, shift: i32, slide: i32) -> RawColumn {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut draw = move || {
            // xorshift64*: sums of twelve are nearly normal.
            (0..12)
                .map(|_| {
                    state ^= state >> 12;
                    state ^= state << 25;
                    state ^= state >> 27;
                    (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f64 / 16_777_216.0
                })
                .sum::<f64>()
                - 6.0
        };
        RawColumn {
            samples: (0..200)
                .map(|i| {
                    let at = i + slide;
                    let step = if at > 120 { 900 } else { 0 };
                    RawSample {
                        lateral_counts: i * 50,
                        range_counts: 50_000 + 30 * at + step + shift + (5.0 * draw()) as i32,
                        intensity: 100,
                        saturated: false,
                    }
                })
                .collect(),
            ..RawColumn::default()
        }
    }

    #[test]
    fn noise_alone_is_no_motion() {
        for seed in 1..200 {
            let outcome = compare(&column(seed, 0, 0), &column(seed + 1_000, 0, 0), COUNT_MM);
            assert_eq!(outcome, Ok(()), "seed {seed}");
        }
    }

    #[test]
    fn a_tenth_of_a_millimetre_is_noticed_in_noise_of_half_that() {
        for seed in 1..200 {
            let moved = compare(&column(seed, 0, 0), &column(seed + 1_000, 10, 0), COUNT_MM);
            let text = moved.expect_err("moved by 0.1 mm");
            assert!(text.contains("mm off"), "{text}");
        }
    }

    #[test]
    fn an_object_slid_along_the_column_is_noticed() {
        assert!(compare(&column(1, 0, 0), &column(2, 0, 1), COUNT_MM).is_err());
        // On the tilt the slide is made up for by the depth; the step betrays it.
        assert!(compare(&column(1, 0, 0), &column(2, -1_800, 60), COUNT_MM).is_err());
    }

    #[test]
    fn returns_that_vanish_are_noticed_and_a_few_are_not() {
        let mut fewer = column(2, 0, 0);
        fewer
            .samples
            .retain(|sample| sample.lateral_counts % 550 != 0);
        assert_eq!(compare(&column(1, 0, 0), &fewer, COUNT_MM), Ok(()));
        fewer.samples.truncate(60);
        let text = compare(&column(1, 0, 0), &fewer, COUNT_MM).expect_err("most are gone");
        assert!(
            text.contains("60 of 200") || text.contains("samples"),
            "{text}"
        );
        assert!(compare(&RawColumn::default(), &column(1, 0, 0), COUNT_MM).is_err());
        let nothing = compare(&RawColumn::default(), &RawColumn::default(), COUNT_MM);
        assert_eq!(nothing, Ok(()));
    }

    #[test]
    fn a_few_samples_tell_a_move_from_noise() {
        let few = |seed, shift| {
            let mut column = column(seed, shift, 0);
            column.samples.truncate(3);
            column
        };
        assert_eq!(compare(&few(1, 0), &few(2, 0), COUNT_MM), Ok(()));
        assert!(compare(&few(1, 0), &few(2, 200), COUNT_MM).is_err());
    }

    #[test]
    fn as_many_columns_are_kept_as_say_something() {
        let mut kept = Kept::default();
        for index in 0..40 {
            let mut next = column(1, 0, 0);
            next.index = index;
            next.samples.truncate(if index < 10 { 200 } else { 30 });
            kept.push(next, 2);
            let last_ones = if index < 11 { 2 } else { 3 };
            assert_eq!(kept.iter().count(), last_ones.min(index as usize + 1));
            assert!(kept.has(index));
        }
    }

    #[test]
    fn a_gap_in_the_object_is_bridged_by_what_was_before_it() {
        let mut kept = Kept::default();
        let mut push = |index, samples| {
            let mut next = column(1, 0, 0);
            next.index = index;
            next.samples.truncate(samples);
            kept.push(next, 2);
            let indices: Vec<u32> = kept.iter().map(|column| column.index).collect();
            assert_eq!(kept.first_index(), indices.first().copied());
            assert!(indices.is_sorted(), "{indices:?}");
            assert!(indices.len() <= 2 * usize::from(MAX_OVERLAP) + 1);
            indices
        };
        // Nothing stands in view: nothing proves anything.
        for index in 0..100 {
            assert_eq!(push(index, 0).len(), 16.min(index as usize + 1));
        }
        for index in 100..110 {
            push(index, 200);
        }
        for index in 110..1_000 {
            // A stray return in the gap proves nothing either.
            let indices = push(index, usize::from(index % 50 == 0));
            assert!(indices.contains(&109), "{indices:?}");
            assert_eq!(indices.last(), Some(&index));
            assert!(!indices.contains(&500) || index < 516, "{indices:?}");
        }
        // The next part begins.
        assert!(push(1_000, 10).contains(&109));
        let indices = push(1_001, 200);
        assert!(indices[0] > 980, "{indices:?}");
    }

    #[test]
    fn outliers_in_both_are_no_motion() {
        let spoilt = |seed, every: usize| {
            let mut column = column(seed, 0, 0);
            for sample in column.samples.iter_mut().step_by(every) {
                sample.range_counts -= 4_000;
            }
            column
        };
        assert_eq!(compare(&spoilt(1, 9), &spoilt(2, 11), COUNT_MM), Ok(()));
    }
}
