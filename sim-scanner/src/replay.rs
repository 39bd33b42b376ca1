//! A recorded scan as a device: its points go over the wire, column by column.
//!
//! Counts are 10 nm throughout, the lattice that scan files are rounded to, so the host gets
//! exactly the numbers that reading the file gives.

use std::path::Path;

use scan_files::{PointScan, ReadOptions, ScanFileError, lattice_counts};
use scanner_protocol::{Calibration, Head, MAX_COLUMN_SAMPLES, ScanPlan};
use thiserror::Error;

use crate::scanner::{Column, Sample};

/// y, z and table travel per count, picometres.
const COUNT_PM: u32 = 10_000;

/// Why a file cannot be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] ScanFileError),
    /// A coordinate is too far out for 32-bit counts of 10 nm.
    #[error("column at x = {x_mm} mm has a point beyond 21 m from the origin")]
    TooFar {
        /// Where.
        x_mm: f64,
    },
    /// A column has more samples than the wire can count.
    #[error(
        "column at x = {x_mm} mm has {samples} samples; at most {MAX_COLUMN_SAMPLES} go over the wire"
    )]
    TooManySamples {
        /// Where.
        x_mm: f64,
        /// How many.
        samples: usize,
    },
    /// The file has more columns than a scan may have.
    #[error("{0} columns are more than a scan may have")]
    TooManyColumns(usize),
    /// The file has no column.
    #[error("no column in it")]
    Empty,
}

/// A recorded scan in counts.
#[derive(Debug, Clone)]
pub struct Replay {
    /// In ascending table position, at least one.
    columns: Vec<Column>,
    pitch_counts: i32,
    spacing_counts: i32,
    lateral_counts: (i32, i32),
    /// Sent in fragments that tell only the first lateral and the step.
    uniform: bool,
}

impl Replay {
    /// Reads any file that `scan-files` reads.
    ///
    /// # Errors
    /// [`ReplayError`] says what is wrong with it.
    pub fn open(path: &Path) -> Result<Self, ReplayError> {
        Self::new(&scan_files::read(path, &ReadOptions::default())?)
    }

    /// A recording of these points.
    ///
    /// # Errors
    /// [`ReplayError`] when it is empty or beyond what the wire can carry.
    pub fn new(scan: &PointScan) -> Result<Self, ReplayError> {
        let mut columns = Vec::with_capacity(scan.columns.len());
        let mut lateral_counts = (i32::MAX, i32::MIN);
        for (index, column) in scan.columns.iter().enumerate() {
            let x_mm = column.x_mm;
            let counts = |mm| lattice_counts(mm).ok_or(ReplayError::TooFar { x_mm });
            if column.samples.len() > usize::from(MAX_COLUMN_SAMPLES) {
                return Err(ReplayError::TooManySamples {
                    x_mm,
                    samples: column.samples.len(),
                });
            }
            let mut samples = Vec::with_capacity(column.samples.len());
            for sample in &column.samples {
                let lateral = counts(sample.y_mm)?;
                lateral_counts = (lateral_counts.0.min(lateral), lateral_counts.1.max(lateral));
                samples.push(Sample {
                    lateral_counts: lateral,
                    range_counts: counts(sample.z_mm)?,
                    intensity: sample.intensity,
                    no_return: false,
                    saturated: false,
                });
            }
            columns.push(Column {
                index: u32::try_from(index)
                    .map_err(|_| ReplayError::TooManyColumns(scan.columns.len()))?,
                table_counts: counts(x_mm)?,
                samples,
            });
        }
        if columns.is_empty() || lateral_counts.0 > lateral_counts.1 {
            return Err(ReplayError::Empty);
        }
        let length = |mm: f64| lattice_counts(mm).unwrap_or(1).max(1);
        Ok(Self {
            columns,
            pitch_counts: length(scan.column_pitch_mm),
            spacing_counts: length(scan.sample_spacing_mm),
            lateral_counts,
            uniform: false,
        })
    }

    /// The same in the shorter encoding, for samples that are evenly spaced in every column;
    /// `None` if they are not.
    #[must_use]
    pub fn into_uniform(self) -> Option<Self> {
        let step = |pair: &[Sample]| match pair {
            [a, b] => i64::from(b.lateral_counts) - i64::from(a.lateral_counts),
            _ => 0,
        };
        let mut steps = self
            .columns
            .iter()
            .map(|column| column.samples.windows(2).map(step));
        let even = steps.all(|mut steps| {
            let first = steps.next();
            steps.all(|step| Some(step) == first)
        });
        even.then_some(Self {
            uniform: true,
            ..self
        })
    }

    pub(crate) fn is_uniform(&self) -> bool {
        self.uniform
    }

    /// What counts mean.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        Calibration {
            table_count_pm: COUNT_PM,
            table_origin_nm: 0,
            head: Head::Cartesian { count_pm: COUNT_PM },
        }
    }

    /// Number of columns in the file.
    #[must_use]
    pub fn columns(&self) -> u32 {
        u32::try_from(self.columns.len()).unwrap_or(u32::MAX)
    }

    /// Number of points in the file.
    #[must_use]
    pub fn points(&self) -> usize {
        self.columns.iter().map(|column| column.samples.len()).sum()
    }

    /// Limits of the table: what the proposed scan needs.
    pub(crate) fn table_counts(&self) -> (i32, i32) {
        let plan = self.proposed();
        let reach = i64::from(plan.pitch_counts) * i64::from(plan.columns - 1);
        let last = i64::from(plan.first_table_counts) + reach;
        let last = last.min(i64::from(i32::MAX)) as i32;
        (plan.first_table_counts, last)
    }

    /// Limits of the laterals: what the proposed scan needs.
    pub(crate) fn lateral_counts(&self) -> (i32, i32) {
        let plan = self.proposed();
        let reach = i64::from(plan.angle_step_counts) * (i64::from(plan.samples) - 1);
        let last = i64::from(plan.first_angle_counts) + reach;
        let last = last.min(i64::from(i32::MAX)) as i32;
        (plan.first_angle_counts, last.max(self.lateral_counts.1))
    }

    pub(crate) fn spacing_um(&self) -> u32 {
        (self.spacing_counts / 100).max(1).unsigned_abs()
    }

    /// A scan that covers the whole recording.
    #[must_use]
    pub fn proposed(&self) -> ScanPlan {
        let first = self.columns.first().map_or(0, |c| c.table_counts);
        let last = self.columns.last().map_or(0, |c| c.table_counts);
        let places = |low: i32, high: i32, step: i32| {
            let reach = (i64::from(high) - i64::from(low)).unsigned_abs();
            reach.div_ceil(u64::from(step.unsigned_abs().max(1))) + 1
        };
        let columns = places(first, last, self.pitch_counts);
        let (low, high) = self.lateral_counts;
        // Few steps suffice to name the stretch where the spacing would need too many.
        let reach = (i64::from(high) - i64::from(low)).unsigned_abs();
        let coarsest = reach.div_ceil(u64::from(MAX_COLUMN_SAMPLES) - 1);
        let step = self
            .spacing_counts
            .max(i32::try_from(coarsest).unwrap_or(i32::MAX));
        ScanPlan {
            first_table_counts: first,
            pitch_counts: self.pitch_counts,
            columns: u32::try_from(columns).unwrap_or(u32::MAX),
            first_angle_counts: low,
            angle_step_counts: step,
            samples: u16::try_from(places(low, high, step)).unwrap_or(u16::MAX),
            exposure_us: 0,
        }
    }

    /// The columns of the file that a plan covers: the first of them, and how many.
    pub(crate) fn select(&self, plan: &ScanPlan) -> (u32, u32) {
        let from = i64::from(plan.first_table_counts);
        let to = from + i64::from(plan.pitch_counts) * (i64::from(plan.columns) - 1);
        let (low, high) = (from.min(to), from.max(to));
        let below = |limit: i64| {
            self.columns
                .partition_point(|c| i64::from(c.table_counts) < limit)
        };
        let first = below(low);
        let count = below(high + 1) - first;
        (first as u32, count as u32)
    }

    /// A column of the selected ones, in the plan's direction, with the samples within the
    /// plan's laterals.
    pub(crate) fn column(&self, plan: &ScanPlan, first: u32, count: u32, index: u32) -> Column {
        let place = if plan.pitch_counts > 0 {
            first.saturating_add(index)
        } else {
            first.saturating_add(count.saturating_sub(index + 1))
        };
        let from = i64::from(plan.first_angle_counts);
        let to = from + i64::from(plan.angle_step_counts) * (i64::from(plan.samples) - 1);
        let laterals = from.min(to)..=from.max(to);
        let recorded = self.columns.get(place as usize);
        Column {
            index,
            table_counts: recorded.map_or(plan.first_table_counts, |c| c.table_counts),
            samples: recorded
                .map(|c| c.samples.as_slice())
                .unwrap_or_default()
                .iter()
                .filter(|s| laterals.contains(&i64::from(s.lateral_counts)))
                .copied()
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> (PointScan, Replay) {
        let points = (0..20).flat_map(|i| {
            (0..30).map(move |j| {
                let x = f64::from(i) * 0.25 - 2.0;
                let y = f64::from(j) * 1.4 + 0.1 * f64::from(i % 3);
                [x, y, 0.3 * x - 0.012_34 * y]
            })
        });
        let scan = scan_files::from_points_mm(points, "a plane", &ReadOptions::default())
            .expect("points enough");
        let replay = Replay::new(&scan).expect("small");
        (scan, replay)
    }

    #[test]
    fn the_proposed_scan_brings_every_point_back_bit_for_bit() {
        let (scan, replay) = recording();
        let plan = replay.proposed();
        let (first, count) = replay.select(&plan);
        assert_eq!((first, count as usize), (0, scan.columns.len()));
        // As the host computes: an exact division gives the nearest float of the count.
        let count_mm = f64::from(COUNT_PM) / 1e9;
        for (index, expected) in scan.columns.iter().enumerate() {
            let column = replay.column(&plan, first, count, index as u32);
            assert_eq!(f64::from(column.table_counts) * count_mm, expected.x_mm);
            let points: Vec<(f64, f64)> = column
                .samples
                .iter()
                .map(|s| {
                    (
                        f64::from(s.lateral_counts) * count_mm,
                        f64::from(s.range_counts) * count_mm,
                    )
                })
                .collect();
            let expected: Vec<(f64, f64)> =
                expected.samples.iter().map(|s| (s.y_mm, s.z_mm)).collect();
            assert_eq!(points, expected);
        }
    }

    #[test]
    fn a_plan_selects_a_stretch_and_a_direction() {
        let (_, replay) = recording();
        let plan = ScanPlan {
            first_table_counts: 100_000,
            pitch_counts: -25_000,
            columns: 5,
            ..replay.proposed()
        };
        let (first, count) = replay.select(&plan);
        assert_eq!(count, 5);
        let places: Vec<i32> = (0..count)
            .map(|i| replay.column(&plan, first, count, i).table_counts)
            .collect();
        assert_eq!(places, [100_000, 75_000, 50_000, 25_000, 0]);
    }

    #[test]
    fn only_what_is_evenly_spaced_is_sent_as_such() {
        let (_, replay) = recording();
        assert!(!replay.is_uniform());
        let mut uneven = replay.clone();
        assert!(
            replay
                .into_uniform()
                .is_some_and(|replay| replay.is_uniform())
        );
        uneven.columns[3].samples[7].lateral_counts += 1;
        assert!(uneven.into_uniform().is_none());
    }
}
