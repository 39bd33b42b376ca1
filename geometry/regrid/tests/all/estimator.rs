//! What the estimator promises, against closed forms.

use crate::common;

use common::{Noise, image, nodes, rms, scan};
use regrid::{Estimator, RegridSettings};

const NOISE_MM: f64 = 0.05;

fn least_squares(settings: RegridSettings) -> RegridSettings {
    RegridSettings {
        estimator: Estimator::LeastSquares,
        ..settings
    }
}

#[test]
fn a_plane_without_noise_is_reproduced() {
    let plane = |x: f64, y: f64| 0.7 * x - 1.3 * y + 250.0;
    for spacing in [(0.4, 0.3), (0.25, 1.4), (1.0, 0.2)] {
        let columns = scan(30.0, spacing, (0.3, 0.6), |x, y| Some(plane(x, y)));
        for settings in [
            RegridSettings::with_pitch(0.7),
            least_squares(RegridSettings::with_pitch(0.7)),
        ] {
            let nodes = nodes(&image(&columns, &settings));
            assert!(nodes.len() > 1700, "{} nodes", nodes.len());
            for (x, y, z) in nodes {
                assert!((z - plane(x, y)).abs() < 1e-9, "{x} {y} {z}");
            }
        }
    }
}

/// 40 % of the samples up to 30 mm too near: MLMS does not see them, least squares fails.
#[test]
fn two_fifths_of_one_sided_outliers_do_no_harm() {
    let plane = |x: f64, y: f64| 0.2 * x + 0.1 * y - 40.0;
    let mut noise = Noise::new(4);
    let columns = scan(30.0, (0.4, 0.4), (0.0, 0.0), |x, y| {
        // Spread evenly, so that every window has its two fifths.
        let place = (x / 0.4).round() + 2.0 * (y / 0.4).round();
        let error = if place.rem_euclid(5.0) < 1.5 {
            5.0 + 25.0 * noise.uniform()
        } else {
            NOISE_MM * noise.normal()
        };
        Some(plane(x, y) + error)
    });
    // With 0.6^3 of the draws free of outliers, 32 would all fail at one node in 2400.
    let settings = RegridSettings {
        draws: 64,
        ..RegridSettings::with_pitch(0.5)
    };
    let error = |settings: &RegridSettings| -> Vec<f64> {
        nodes(&image(&columns, settings))
            .into_iter()
            .filter(|(x, y, _)| (3.0..27.0).contains(x) && (3.0..27.0).contains(y))
            .map(|(x, y, z)| (z - plane(x, y)).abs())
            .collect()
    };
    let robust = error(&settings);
    assert_eq!(robust.len(), 48 * 48, "no holes");
    let plain = error(&least_squares(settings));
    let share_bad = robust.iter().filter(|e| **e > 0.5).count() as f64 / robust.len() as f64;
    assert!(share_bad < 0.005, "{share_bad}");
    let mut sorted = robust.clone();
    sorted.sort_by(f64::total_cmp);
    assert!(
        sorted[sorted.len() / 2] < NOISE_MM,
        "{}",
        sorted[sorted.len() / 2]
    );
    assert!(rms(plain.into_iter()) > 5.0);
}

#[test]
fn a_step_edge_stays_a_step_where_least_squares_smears() {
    for along_x in [true, false] {
        let height = |x: f64, y: f64| {
            if (if along_x { x } else { y }) < 15.13 {
                0.0
            } else {
                10.0
            }
        };
        let mut noise = Noise::new(9);
        let columns = scan(30.0, (0.4, 0.4), (0.5, 0.5), |x, y| {
            Some(height(x, y) + NOISE_MM * noise.normal())
        });
        let in_between = |settings: &RegridSettings| {
            nodes(&image(&columns, settings))
                .iter()
                .filter(|(_, _, z)| (0.5..9.5).contains(z))
                .count()
        };
        let settings = RegridSettings::with_pitch(0.4);
        let robust = in_between(&settings);
        let smeared = in_between(&least_squares(settings));
        assert!(robust <= 3, "{robust} nodes between the levels");
        assert!(smeared > 150, "{smeared}");
        // The edge itself lies where it is, to a pitch.
        for (x, y, z) in nodes(&image(&columns, &settings)) {
            let across = if along_x { x } else { y };
            if (across - 15.13).abs() > 0.5 && (1.0..29.0).contains(&x) && (1.0..29.0).contains(&y)
            {
                assert!((z - height(x, y)).abs() < 0.5, "{x} {y} {z}");
            }
        }
    }
}

/// Three samples in ten are wrong, in runs along the columns: by consensus the nodes a pitch
/// or more from the step lie on their plane, and those away from it know it well.
#[test]
fn consensus_holds_next_to_a_step_among_runs_of_outliers() {
    let height = |x: f64, y: f64| 0.1 * x + if x + 0.4 * y < 20.13 { 0.0 } else { 5.0 };
    let mut noise = Noise::new(21);
    let (mut left, mut offset) = (0, 0.0);
    let columns = scan(30.0, (0.4, 0.4), (0.3, 0.6), |x, y| {
        if left == 0 && noise.uniform() < 0.07 {
            left = 3 + (6.0 * noise.uniform()) as u32;
            offset = 60.0 * noise.uniform() - 30.0;
        }
        let error = if left > 0 { offset } else { 0.0 };
        left = left.saturating_sub(1);
        Some(height(x, y) + error + NOISE_MM * noise.normal())
    });
    let settings = RegridSettings {
        estimator: Estimator::Consensus,
        neighbours: Estimator::Consensus.neighbours(),
        ..RegridSettings::with_pitch(0.4)
    };
    let (mut away, mut wrong, mut near) = (Vec::new(), 0, 0);
    for (x, y, z) in nodes(&image(&columns, &settings)) {
        let from_step = (x + 0.4 * y - 20.13).abs() / (1.0_f64 + 0.4 * 0.4).sqrt();
        let error = z - height(x, y);
        if from_step > 1.5 {
            away.push(error);
        } else if from_step > 0.4 {
            near += 1;
            wrong += usize::from(error.abs() > 0.5);
        }
    }
    assert!(away.len() > 4500, "{}", away.len());
    assert!(near > 300 && wrong <= 2, "{wrong} of {near}");
    let gross = away.iter().filter(|e| e.abs() > 0.5).count();
    assert!(gross <= 1, "{gross} gross errors");
    let fine = rms(away.into_iter().filter(|e| e.abs() <= 0.5));
    assert!(fine < 0.012, "{fine}");
}

/// Steep faces that meet at an oblique ridge, whose noise along z is the more: no plane of one
/// is carried on over the ridge.
#[test]
fn consensus_keeps_ridges() {
    let across = |x: f64, y: f64| (x + 0.7 * y - 25.13) / (1.0_f64 + 0.7 * 0.7).sqrt();
    let height = |x: f64, y: f64| -(0.9 * across(x, y)).max(-1.1 * across(x, y));
    let mut noise = Noise::new(31);
    let columns = scan(30.0, (0.4, 0.55), (0.2, 0.4), |x, y| {
        Some(height(x, y) + 2.0 * NOISE_MM * noise.normal())
    });
    let settings = RegridSettings::with_pitch(0.45);
    let (mut worst, mut near) = (0.0_f64, 0);
    for (x, y, z) in nodes(&image(&columns, &settings)) {
        if across(x, y).abs() < 3.0 && (2.0..28.0).contains(&x) && (2.0..28.0).contains(&y) {
            worst = worst.max((z - height(x, y)).abs());
            near += 1;
        }
    }
    println!("{worst} of {near}");
    assert!(near > 500, "{near}");
    assert!(worst < 0.4, "{worst}");
}

/// Short blocks on a base, whose flanks are two samples wide: with large faces in every window,
/// and the base on either side of the block and beyond its ends, the flank keeps its nodes.
#[test]
fn consensus_keeps_flanks_between_faces() {
    let (own, all) = own_nodes_of_flanks(0.8, 0.0);
    assert!(all > 350, "{all}");
    assert!(own * 100 >= all * 83, "{own} of {all}");
}

/// So does a flank hardly wider than the pitch, of which no window holds more than a line of
/// samples, at most of its nodes.
#[test]
fn consensus_keeps_flanks_of_one_sample() {
    let (own, all) = own_nodes_of_flanks(0.5, 0.0);
    assert!(all > 180, "{all}");
    assert!(own * 100 >= all * 58, "{own} of {all}");
}

/// And so does a flank where elsewhere in its columns the base has ribs a sample wide: they differ
/// from what lies beside them by more than noise, but are no outliers.
#[test]
fn consensus_keeps_flanks_where_ribs_are_around() {
    let (own, all) = own_nodes_of_flanks(0.8, 0.6);
    assert!(all > 350, "{all}");
    assert!(own * 100 >= all * 83, "{own} of {all}");
}

/// How many nodes well within flanks of this width have their z, of how many. Apart from the blocks
/// the base has ribs of this height.
fn own_nodes_of_flanks(width_mm: f64, ribs_mm: f64) -> (usize, usize) {
    const TOP_MM: f64 = 5.0;
    const HALF_LENGTH_MM: f64 = 6.0;
    let (mut own, mut all) = (0, 0);
    for (seed, turn) in [(5, 0.0), (6, 0.35), (7, 0.8), (8, 1.57)] {
        let (sin, cos) = libm::sincos(turn);
        // From the block's middle line, and along it.
        let across = |x: f64, y: f64| cos * (x - 15.0) + sin * (y - 15.0);
        let along = |x: f64, y: f64| cos * (y - 15.0) - sin * (x - 15.0);
        let rise = |x: f64, y: f64| {
            let inside = along(x, y).abs() < HALF_LENGTH_MM;
            let rise = (0.5 * TOP_MM + width_mm - across(x, y).abs()) / width_mm;
            if inside { rise.clamp(0.0, 1.0) } else { 0.0 }
        };
        let rib = |y: f64| f64::from(!(6.5..23.5).contains(&y) && y.rem_euclid(2.0) < 0.4);
        let height = |x: f64, y: f64| 0.1 * x + 2.4 * rise(x, y) + ribs_mm * rib(y);
        let mut noise = Noise::new(seed);
        let columns = scan(30.0, (0.4, 0.4), (0.1, 0.3), |x, y| {
            Some(height(x, y) + NOISE_MM * noise.normal())
        });
        let settings = RegridSettings::with_pitch(0.4);
        for (x, y, z) in nodes(&image(&columns, &settings)) {
            let beside_end = along(x, y).abs() > HALF_LENGTH_MM - 1.0;
            if !beside_end && (0.1..0.9).contains(&rise(x, y)) {
                all += 1;
                own += usize::from((z - height(x, y)).abs() < 0.3);
            }
        }
    }
    (own, all)
}

/// The window averages: noise at the nodes is well below that of the samples, and on a
/// sphere the bias of a plane stays below the noise.
#[test]
fn noise_shrinks_and_curvature_is_followed() {
    let mut noise = Noise::new(2);
    let sphere = |x: f64, y: f64| {
        let (u, v) = (x - 15.0, y - 15.0);
        (40.0_f64 * 40.0 - u * u - v * v).sqrt()
    };
    let columns = scan(30.0, (0.42, 0.39), (0.0, 0.0), |x, y| {
        Some(sphere(x, y) + NOISE_MM * noise.normal())
    });
    for (settings, limit) in [
        (RegridSettings::with_pitch(0.42), 0.9 * NOISE_MM),
        (
            least_squares(RegridSettings::with_pitch(0.42)),
            0.5 * NOISE_MM,
        ),
    ] {
        let inner: Vec<_> = nodes(&image(&columns, &settings))
            .into_iter()
            .filter(|(x, y, _)| (2.0..28.0).contains(x) && (2.0..28.0).contains(y))
            .collect();
        let error = rms(inner.iter().map(|(x, y, z)| z - sphere(*x, *y)));
        assert!(error < limit, "{error}");
    }
}

/// Depths in steps of twice the spacing: a window's samples lie on two or three terraces, which
/// are one surface.
#[test]
fn terraces_of_coarse_depths_are_one_surface() {
    const STEP_MM: f64 = 0.35;
    let plane = |x: f64, y: f64| 0.3 * x - 0.4 * y + 250.0;
    let mut noise = Noise::new(3);
    let columns = scan(12.0, (0.17, 0.17), (0.3, 0.6), |x, y| {
        let z = plane(x, y) + 0.1 * NOISE_MM * noise.normal();
        Some(STEP_MM * (z / STEP_MM).round())
    });
    let settings = RegridSettings {
        estimator: Estimator::Consensus,
        ..RegridSettings::with_pitch(0.17)
    };
    let image = image(&columns, &settings);
    let (mut whole, mut number) = (0, 0);
    for (column, row) in (0..image.columns()).flat_map(|c| (0..image.rows()).map(move |r| (c, r))) {
        if let Some(quality) = image.quality(column, row) {
            number += 1;
            whole += usize::from(f64::from(quality.inliers) >= 0.95 * f64::from(quality.samples));
        }
    }
    assert!(number > 4500, "{number} nodes");
    assert!(whole as f64 > 0.95 * number as f64, "{whole} of {number}");
    let nodes = nodes(&image);
    let error = rms(nodes.iter().map(|(x, y, z)| z - plane(*x, *y)));
    assert!(error < 0.1 * STEP_MM, "{error}");
}
