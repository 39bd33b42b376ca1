//! Which samples are borne out by those around them.

use range_image::{Column, Sample};
use rayon::prelude::*;

/// Neighbours along the column that are looked at, to either side.
const ALONG: usize = 2;
/// Neighbours in each column beside it.
const ACROSS: usize = 3;
/// So many of them must agree.
const FEWEST: usize = 3;
/// Deviations of the noise by which neighbours on one surface differ at most.
const DEVIATIONS: f64 = 4.5;
/// Rise over run up to which neighbours agree whatever the noise: the sides of countersinks and
/// chamfers, and somewhat more.
const SLOPE: f64 = 1.5;

/// For each sample of each column, whether at least [`FEWEST`] of its neighbours lie as near to
/// it in z as noise and slopes let them. Columns are in the order of their x.
pub(super) fn supported(columns: &[Column], noise_mm: f64) -> Vec<Vec<bool>> {
    (0..columns.len())
        .into_par_iter()
        .map(|index| of_column(columns, index, noise_mm))
        .collect()
}

fn of_column(columns: &[Column], index: usize, noise_mm: f64) -> Vec<bool> {
    let own = columns[index].samples();
    let beside = [index.checked_sub(1), Some(index + 1)]
        .into_iter()
        .flatten()
        .filter_map(|other| columns.get(other))
        .map(|other| {
            (
                (other.x_mm() - columns[index].x_mm()).abs(),
                other.samples(),
            )
        })
        .collect::<Vec<_>>();
    let mut starts = vec![0_usize; beside.len()];
    let agrees = |a: &Sample, b: &Sample, across_mm: f64| {
        let dy = a.y_mm - b.y_mm;
        let apart = (dy * dy + across_mm * across_mm).sqrt();
        (a.z_mm - b.z_mm).abs() <= DEVIATIONS * noise_mm + SLOPE * apart
    };
    own.iter()
        .enumerate()
        .map(|(at, sample)| {
            let low = at.saturating_sub(ALONG);
            let high = (at + ALONG + 1).min(own.len());
            let mut count = own[low..high]
                .iter()
                .enumerate()
                .filter(|(k, other)| low + k != at && agrees(sample, other, 0.0))
                .count();
            for ((across_mm, samples), start) in beside.iter().zip(&mut starts) {
                // y rises along a column, so that the place beside it only moves up.
                while *start < samples.len() && samples[*start].y_mm < sample.y_mm {
                    *start += 1;
                }
                let low = start.saturating_sub(ACROSS / 2 + 1);
                let high = (low + ACROSS).min(samples.len());
                count += samples[low..high]
                    .iter()
                    .filter(|other| agrees(sample, other, *across_mm))
                    .count();
            }
            count >= FEWEST
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_alone_is_not_borne_out_and_both_sides_of_a_step_are() {
        let column = |i: i32| {
            let samples = (0..20).map(|j| Sample {
                y_mm: f64::from(j),
                z_mm: match (i, j) {
                    (5, 7) => 20.0,
                    (9, 12) => -25.0,
                    _ if j >= 10 => -5.0,
                    _ => 0.0,
                },
                intensity: 255,
            });
            Column::new(f64::from(i), samples.collect())
        };
        let columns: Vec<Column> = (0..12).map(column).collect();
        let kept = supported(&columns, 0.05);
        for (i, own) in kept.iter().enumerate() {
            for (j, kept) in own.iter().enumerate() {
                let alone = (i, j) == (5, 7) || (i, j) == (9, 12);
                let at_corner = (i == 0 || i == 11) && (j == 0 || j == 19);
                assert!(at_corner || *kept != alone, "column {i}, sample {j}");
            }
        }
    }
}
