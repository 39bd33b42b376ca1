//! The same scan gives the same bits, however it is handed over.

use crate::common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Noise, columns, image, steps};
use range_image::{
    Column, Lattice, Monitor, NodeQuality, RangeImage, RangeImageBuilder, Sample, Unmonitored,
};
use regrid::{Estimator, RegridError, RegridSettings, Regridder, regrid};

/// A wavy part with a step, a hole, noise, dropouts and empty columns at both ends.
fn part(length: i32, seed: u64) -> Vec<Column> {
    let mut noise = Noise::new(seed);
    columns(steps(-7.0, 0.37, length), |x| {
        if !(-5.5..0.37 * f64::from(length) - 9.0).contains(&x) {
            return Vec::new();
        }
        let mut samples = Vec::new();
        let mut y = -4.0 + noise.uniform();
        while y < 9.0 {
            y += 0.3 + 0.2 * noise.uniform();
            let step = if x + 0.3 * y > 2.0 { 6.0 } else { 0.0 };
            let z = libm::sin(0.4 * x) + 0.1 * y * y + step + 0.05 * noise.normal();
            let hole = (x - 1.0).abs() < 1.0 && (y - 1.0).abs() < 1.5;
            if !hole && noise.uniform() > 0.05 {
                samples.push((y, z));
            }
        }
        samples
    })
}

type Bits = (i64, i64, usize, Vec<u64>, Vec<NodeQuality>);

fn bits(image: &RangeImage) -> Bits {
    let (i, j) = image.origin();
    let z = image.raw_z_mm().iter().map(|z| z.to_bits()).collect();
    let qualities: Vec<NodeQuality> = image.qualities().collect();
    assert_eq!(qualities.len(), image.valid_nodes(), "one for each node");
    assert!(qualities.iter().all(|q| q.inliers <= q.samples));
    (i, j, image.columns(), z, qualities)
}

fn streamed(columns: &[Column], settings: &RegridSettings) -> RangeImage {
    let mut regridder = Regridder::new(*settings).expect("sound settings");
    let mut builder = RangeImageBuilder::new(Lattice {
        pitch_mm: settings.pitch_mm,
    });
    let mut order = Vec::new();
    for column in columns {
        for grid in regridder.push(column.clone()).expect("a sound column") {
            order.push(grid.i);
            builder.push(grid);
        }
    }
    for grid in regridder.finish() {
        order.push(grid.i);
        builder.push(grid);
    }
    let ascending = order.windows(2).all(|pair| pair[0] < pair[1]);
    let descending = order.windows(2).all(|pair| pair[0] > pair[1]);
    assert!(
        ascending || descending,
        "in the direction of travel, each once"
    );
    builder.finish()
}

#[test]
fn streaming_batch_threads_and_direction_agree_bit_for_bit() {
    agree_bit_for_bit(Estimator::LeastMedian);
}

#[test]
fn they_agree_by_consensus_too() {
    agree_bit_for_bit(Estimator::Consensus);
}

fn agree_bit_for_bit(estimator: Estimator) {
    for (pitch, reach, length) in [(0.41, 8, 60), (0.2, 5, 40), (1.7, 3, 60), (0.5, 8, 9)] {
        let columns = part(length, 5);
        let settings = |threads| RegridSettings {
            reach_columns: reach,
            threads,
            estimator,
            neighbours: estimator.neighbours(),
            ..RegridSettings::with_pitch(pitch)
        };
        let expected = bits(&image(&columns, &settings(1)));
        if length > 9 {
            assert!(
                expected
                    .3
                    .iter()
                    .filter(|z| !f64::from_bits(**z).is_nan())
                    .count()
                    > 50
            );
        }
        let backwards: Vec<Column> = columns.iter().rev().cloned().collect();
        for threads in [0, 1, 2, 5] {
            assert_eq!(bits(&image(&columns, &settings(threads))), expected);
            assert_eq!(bits(&image(&backwards, &settings(threads))), expected);
        }
        assert_eq!(bits(&streamed(&columns, &settings(0))), expected);
        assert_eq!(bits(&streamed(&backwards, &settings(0))), expected);
    }
}

#[test]
fn a_mirrored_scan_gives_the_mirrored_image_bit_for_bit() {
    let columns = part(60, 8);
    let mirrored: Vec<Column> = columns
        .iter()
        .map(|c| Column::new(-c.x_mm(), c.samples().to_vec()))
        .collect();
    for estimator in [Estimator::LeastMedian, Estimator::Consensus] {
        let settings = RegridSettings {
            estimator,
            ..RegridSettings::with_pitch(0.43)
        };
        mirrored_images_agree(&image(&columns, &settings), &image(&mirrored, &settings));
    }
}

fn mirrored_images_agree(there: &RangeImage, back: &RangeImage) {
    assert_eq!(
        (there.columns(), there.rows()),
        (back.columns(), back.rows())
    );
    assert_eq!(
        back.origin().0,
        -(there.origin().0 + there.columns() as i64 - 1)
    );
    for column in 0..there.columns() {
        for row in 0..there.rows() {
            let mirror = back.z_mm(there.columns() - 1 - column, row);
            let z = there.z_mm(column, row);
            assert_eq!(
                z.map(f64::to_bits),
                mirror.map(f64::to_bits),
                "{column} {row}"
            );
        }
    }
}

#[test]
fn the_seed_changes_the_draws_and_nothing_else() {
    let columns = part(60, 5);
    let of = |seed| {
        image(
            &columns,
            &RegridSettings {
                seed,
                ..RegridSettings::with_pitch(0.41)
            },
        )
    };
    let (one, two) = (of(1), of(2));
    assert_ne!(bits(&one), bits(&two));
    let differences = (one.valid_nodes() as f64 - two.valid_nodes() as f64).abs();
    assert!(differences < 0.02 * one.valid_nodes() as f64);
}

#[test]
fn memory_does_not_grow_with_the_length_of_the_scan() {
    const REACH: usize = 8;
    let greatest = |length: i32| {
        let settings = RegridSettings {
            reach_columns: REACH,
            ..RegridSettings::with_pitch(0.41)
        };
        let mut regridder = Regridder::new(settings).unwrap();
        let (mut columns, mut samples, mut grid) = (0, 0, 0);
        for column in part(length, 6) {
            grid += regridder.push(column).unwrap().len();
            columns = columns.max(regridder.retained_columns());
            samples = samples.max(regridder.retained_samples());
        }
        assert!(grid > length as usize / 2, "finished as it goes");
        (columns, samples)
    };
    let (columns_10, samples_10) = greatest(600);
    let (columns_40, samples_40) = greatest(2400);
    assert_eq!(columns_10, columns_40);
    assert!(columns_10 <= 2 * REACH + 1, "{columns_10}");
    // Dropouts differ from stretch to stretch; a column holds at most 44 samples.
    assert!(
        samples_40.abs_diff(samples_10) < 44,
        "{samples_10} {samples_40}"
    );
    assert!(samples_40 <= columns_40 * 44);
}

#[test]
fn a_grid_column_is_finished_after_the_reach() {
    let mut regridder = Regridder::new(RegridSettings {
        reach_columns: 3,
        ..RegridSettings::with_pitch(1.0)
    })
    .unwrap();
    let mut last = i64::MIN;
    for column in columns(steps(0.0, 1.0, 30), |_| {
        steps(0.0, 1.0, 30).map(|y| (y, 0.0)).collect()
    }) {
        let x = column.x_mm() as i64;
        for grid in regridder.push(column).unwrap() {
            last = grid.i;
        }
        if x > 4 {
            assert_eq!(last, x - 3);
        }
    }
}

#[test]
fn columns_that_turn_back_are_refused_and_leave_no_trace() {
    let columns = part(60, 5);
    let mut regridder = Regridder::new(RegridSettings::with_pitch(0.41)).unwrap();
    let mut builder = RangeImageBuilder::new(Lattice { pitch_mm: 0.41 });
    for (index, column) in columns.iter().enumerate() {
        regridder
            .push(column.clone())
            .unwrap()
            .into_iter()
            .for_each(|c| builder.push(c));
        if index > 0 {
            let again = regridder.push(column.clone());
            assert!(
                matches!(again, Err(RegridError::NotMonotone { .. })),
                "{again:?}"
            );
        }
        if index == 30 {
            let message = regridder.push(columns[4].clone()).unwrap_err().to_string();
            assert!(message.contains("column 31 at x = -5.52"), "{message}");
        }
    }
    regridder.finish().into_iter().for_each(|c| builder.push(c));
    let expected = image(&columns, &RegridSettings::with_pitch(0.41));
    assert_eq!(bits(&builder.finish()), bits(&expected));
    let mut turned = columns.clone();
    turned.swap(10, 11);
    let refused = regrid(turned, &RegridSettings::with_pitch(0.41), &Unmonitored);
    assert!(matches!(
        refused,
        Err(RegridError::NotMonotone { index: 11, .. })
    ));
}

#[test]
fn absurd_coordinates_and_grids_are_refused() {
    let settings = RegridSettings::with_pitch(0.41);
    for (x, y, z) in [(f64::NAN, 0.0, 0.0), (0.0, 1e9, 0.0), (0.0, 0.0, -1e9)] {
        let sample = Sample {
            y_mm: y,
            z_mm: z,
            intensity: 0,
        };
        let column = Column::new(x, vec![sample]);
        let mut regridder = Regridder::new(settings).unwrap();
        let refused = regridder.push(column);
        assert!(
            matches!(refused, Err(RegridError::TooFar { .. })),
            "{refused:?}"
        );
    }
}

#[test]
fn cancellation_and_progress_reach_the_caller() {
    struct Watch {
        left: AtomicUsize,
        seen: Mutex<Vec<f64>>,
    }
    impl Monitor for Watch {
        fn is_cancelled(&self) -> bool {
            let less = |left: usize| left.checked_sub(1);
            self.left
                .fetch_update(Ordering::SeqCst, Ordering::SeqCst, less)
                .is_err()
        }
        fn progress(&self, fraction: f64) {
            self.seen.lock().unwrap().push(fraction);
        }
    }
    let watch = |left| Watch {
        left: AtomicUsize::new(left),
        seen: Mutex::new(Vec::new()),
    };
    let columns = part(60, 5);
    let settings = RegridSettings::with_pitch(0.41);
    let patient = watch(usize::MAX);
    regrid(columns.clone(), &settings, &patient).unwrap();
    let seen = patient.seen.into_inner().unwrap();
    assert!(seen.windows(2).all(|pair| pair[0] <= pair[1]));
    assert!(seen.len() > 30 && seen.last() == Some(&1.0));
    let refused = regrid(columns, &settings, &watch(10));
    assert!(matches!(refused, Err(RegridError::Cancelled(_))));
}
