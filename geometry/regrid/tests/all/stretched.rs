//! Scans whose samples lie much closer together one way than the other.

use crate::common::{Noise, columns, image, nodes, rms, steps};
use regrid::{Estimator, RegridSettings};

const NOISE_MM: f64 = 0.05;

/// A roof with its ridge along a diagonal.
fn height(x: f64, y: f64) -> f64 {
    -0.6 * ((x - 15.0) + 0.5 * (y - 15.0)).abs()
}

fn to_ridge(x: f64, y: f64) -> f64 {
    ((x - 15.0) + 0.5 * (y - 15.0)).abs() / 1.25_f64.sqrt()
}

/// How many nodes there are 3 mm and more from the border, their greatest error, and the rms of
/// those a spacing or more from the ridge.
fn errors(spacing: (f64, f64), estimator: Estimator, outliers: f64) -> (usize, f64, f64) {
    let mut noise = Noise::new(51);
    let number = |step: f64| (30.0 / step) as i32 + 1;
    let columns = columns(steps(0.3 * spacing.0, spacing.0, number(spacing.0)), |x| {
        let beam = |at: f64| {
            // Leaning as beams do: what one of them measures in all columns lies in its plane.
            let lean = (at + 60.0) / 250.0;
            let mut z = 0.0;
            for _ in 0..40 {
                z = height(x, at + lean * z);
            }
            let z = if noise.uniform() < outliers {
                40.0 * (noise.uniform() - 0.5)
            } else {
                z + NOISE_MM * noise.normal()
            };
            (at + lean * z, z)
        };
        steps(0.6 * spacing.1, spacing.1, number(spacing.1))
            .map(beam)
            .collect()
    });
    let pitch_mm = (spacing.0 * spacing.1).sqrt();
    let settings = RegridSettings::with_pitch(pitch_mm).with_estimator(estimator);
    let (mut number, mut worst, mut flat) = (0, 0.0_f64, Vec::new());
    for (x, y, z) in nodes(&image(&columns, &settings)) {
        if (3.0..27.0).contains(&x) && (3.0..27.0).contains(&y) {
            number += 1;
            let error = (z - height(x, y)).abs();
            worst = worst.max(error);
            if to_ridge(x, y) > spacing.0.max(spacing.1) {
                flat.push(error);
            }
        }
    }
    (number, worst, rms(flat.into_iter()))
}

/// All that is nearest to a node may be of one beam or of one column. Planes on one line of samples
/// lean anywhere, and a beam's own plane holds its outliers, too.
#[test]
fn no_plane_leans_on_one_line_of_samples() {
    for spacing in [(0.12_f64, 1.8), (1.8, 0.12), (0.1, 2.4)] {
        let all = (24.0 / (spacing.0 * spacing.1).sqrt()).ceil().powi(2);
        let (number, worst, flat) = errors(spacing, Estimator::Consensus, 0.02);
        println!("{spacing:?}: {number} of {all}, {worst}, {flat}");
        assert!(number as f64 > 0.99 * all, "{number} of {all}");
        // A spacing beside the ridge the roof is 0.6 of it lower.
        assert!(worst < 0.3 * spacing.0.max(spacing.1), "{worst}");
        assert!(flat < 0.3 * NOISE_MM, "{flat}");
        let (number, worst, flat) = errors(spacing, Estimator::LeastMedian, 0.02);
        println!("{spacing:?}: {number} of {all}, {worst}, {flat}");
        assert!(number as f64 > 0.99 * all, "{number} of {all}");
        assert!(worst < 0.8 * spacing.0.max(spacing.1), "{worst}");
        assert!(flat < 1.2 * NOISE_MM, "{flat}");
    }
}
