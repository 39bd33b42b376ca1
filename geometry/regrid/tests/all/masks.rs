//! Which nodes get a value.

use crate::common;

use common::{Noise, columns, image, nodes, scan, steps};
use range_image::{Column, RangeImage};
use regrid::{RegridSettings, Roi};

fn holds(image: &RangeImage, x: f64, y: f64) -> bool {
    let (i, j) = image.origin();
    let column = (x / image.pitch_mm()).round() as i64 - i;
    let row = (y / image.pitch_mm()).round() as i64 - j;
    match (usize::try_from(column), usize::try_from(row)) {
        (Ok(column), Ok(row)) => image.z_mm(column, row).is_some(),
        _ => false,
    }
}

/// A square patch in free space with its corners at 5.13 and 24.87, its samples where the
/// scan's lattice happens to lie.
fn patch(spacing: (f64, f64), phase: (f64, f64), interlaced: bool) -> Vec<Column> {
    let inside = |v: f64| (5.13..24.87).contains(&v);
    let mut odd = false;
    let number = |step: f64| (30.0 / step) as i32 + 1;
    columns(
        steps(phase.0 * spacing.0, spacing.0, number(spacing.0)),
        |x| {
            odd = !odd;
            let shift = if interlaced && odd { 0.5 } else { 0.0 };
            steps((phase.1 + shift) * spacing.1, spacing.1, number(spacing.1))
                .filter(|y| inside(x) && inside(*y))
                .map(|y| (y, 3.0))
                .collect()
        },
    )
}

/// The area of the nodes, and of each side the mean place where nodes end.
#[test]
fn the_outline_of_a_patch_is_unbiased_within_half_a_pitch() {
    for (spacing, interlaced, pitch) in [
        ((0.25, 1.4), true, 0.59),
        ((0.42, 0.39), false, 0.42),
        ((0.1, 0.15), false, 0.4),
        ((0.6, 0.5), false, 0.25),
        ((1.0, 0.2), false, 1.0),
    ] {
        let (mut sides, mut scans) = ([0.0; 4], 0.0);
        for phase in [
            (0.0, 0.0),
            (0.25, 0.75),
            (0.5, 0.4),
            (0.75, 0.1),
            (0.9, 0.6),
        ] {
            let image = image(
                &patch(spacing, phase, interlaced),
                &RegridSettings::with_pitch(pitch),
            );
            let nodes = nodes(&image);
            // Half a node beyond the first and last node with a value, in the middle rows.
            let ends = |values: Vec<f64>| {
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                (low - 0.5 * pitch, high + 0.5 * pitch)
            };
            let middle = |v: f64| (10.0..20.0).contains(&v);
            let rows: Vec<f64> = nodes.iter().filter(|n| middle(n.1)).map(|n| n.0).collect();
            let lines: Vec<f64> = nodes.iter().filter(|n| middle(n.0)).map(|n| n.1).collect();
            let ((left, right), (bottom, top)) = (ends(rows), ends(lines));
            let errors = [5.13 - left, right - 24.87, 5.13 - bottom, top - 24.87];
            for (side, error) in sides.iter_mut().zip(errors) {
                // One scan says no more than where its samples and nodes happen to lie.
                let (step, half) = (spacing.0.max(spacing.1), 0.5 * pitch);
                assert!(
                    error.abs() < half + step,
                    "{spacing:?} {phase:?}: {errors:?}"
                );
                *side += error;
            }
            scans += 1.0;
        }
        for side in sides {
            let bias = side / scans;
            assert!(
                bias.abs() <= 0.5 * pitch,
                "{spacing:?}: {sides:?} / {scans}"
            );
        }
    }
}

#[test]
fn an_oblique_outline_is_unbiased_too() {
    // A disc of radius 10: its area tells the mean place of the outline.
    for (spacing, pitch) in [((0.42, 0.39), 0.42), ((0.2, 0.25), 0.5), ((0.8, 0.7), 0.4)] {
        let columns = scan(30.0, spacing, (0.3, 0.7), |x, y| {
            let (u, v) = (x - 15.0, y - 15.0);
            (u * u + v * v < 100.0).then_some(0.02 * u)
        });
        let nodes = nodes(&image(&columns, &RegridSettings::with_pitch(pitch)));
        let area = nodes.len() as f64 * pitch * pitch;
        let radius = (area / core::f64::consts::PI).sqrt();
        assert!((radius - 10.0).abs() < 0.5 * pitch, "{spacing:?}: {radius}");
    }
}

#[test]
fn holes_stay_and_dropouts_do_not() {
    let pitch = 0.42;
    let hole = 5.0 * pitch;
    let mut noise = Noise::new(3);
    let columns = scan(30.0, (0.42, 0.39), (0.2, 0.4), |x, y| {
        let (u, v) = ((x - 15.0).abs(), (y - 15.0).abs());
        // Lone dropouts all over, a square hole of five pitches in the middle.
        let dropped = noise.uniform() < 0.08;
        let outlier = noise.uniform() < 0.03;
        let z = if outlier {
            20.0 * noise.uniform()
        } else {
            0.05 * noise.normal()
        };
        (!dropped && (u > 0.5 * hole || v > 0.5 * hole)).then_some(z)
    });
    let image = image(&columns, &RegridSettings::with_pitch(pitch));
    let (mut in_hole, mut lost, mut inside) = (0, 0, 0);
    for i in 0..72 {
        for j in 0..72 {
            let (x, y) = (f64::from(i) * pitch, f64::from(j) * pitch);
            let (u, v) = ((x - 15.0).abs(), (y - 15.0).abs());
            if u.max(v) < 0.5 * hole - pitch {
                in_hole += usize::from(holds(&image, x, y));
                inside += 1;
            } else if u.max(v) > 0.5 * hole + pitch && x.min(y) > 1.0 && x.max(y) < 29.0 {
                lost += usize::from(!holds(&image, x, y));
            }
        }
    }
    assert!(inside >= 9, "{inside}");
    assert_eq!((in_hole, lost), (0, 0));
}

#[test]
fn one_dropout_is_filled_and_one_outlier_is_no_hole() {
    let with_fault = |fault: Option<f64>| {
        scan(10.0, (0.5, 0.5), (0.0, 0.0), |x, y| {
            if (x - 5.0).abs() < 0.1 && (y - 5.0).abs() < 0.1 {
                fault
            } else {
                Some(1.0)
            }
        })
    };
    for fault in [None, Some(30.0), Some(1.0)] {
        let image = image(&with_fault(fault), &RegridSettings::with_pitch(0.5));
        assert_eq!(image.valid_nodes(), 21 * 21, "{fault:?}");
        assert_eq!(image.z_extent_mm(), Some((1.0, 1.0)));
    }
}

/// Three columns side by side in which eight samples in a row are off, each by its own amount,
/// and the same samples missing.
#[test]
fn runs_of_outliers_leave_no_hole_where_missing_samples_do() {
    for (side_by_side, samples, missing) in [(3, 8, false), (4, 5, false), (9, 9, true)] {
        let mut noise = Noise::new(21);
        let columns = scan(24.0, (0.4, 0.4), (0.1, 0.3), |x, y| {
            let (u, v) = ((x - 12.0) / 0.4, (y - 12.0) / 0.4);
            let within = |off: f64, most: i32| off.abs() < 0.5 * f64::from(most);
            let z = 0.1 * x + 0.05 * noise.normal();
            if !(within(u, side_by_side) && within(v, samples)) {
                return Some(z);
            }
            (!missing).then(|| z + 7.0 * (3.0 + u.round()))
        });
        let image = image(&columns, &RegridSettings::with_pitch(0.4));
        let empty = |node: usize| {
            let (column, row) = (node / image.rows(), node % image.rows());
            image.z_mm(column, row).is_none()
        };
        let holes = (0..image.columns() * image.rows()).filter(|&n| empty(n));
        assert_eq!(holes.count() > 0, missing, "{side_by_side} {samples}");
        for (x, _, z) in nodes(&image) {
            assert!((z - 0.1 * x).abs() < 0.1, "{x} {z}");
        }
    }
}

#[test]
fn lone_outliers_in_free_space_give_nothing() {
    let mut noise = Noise::new(12);
    let columns = scan(60.0, (0.4, 0.4), (0.0, 0.0), |x, y| {
        let on_part = (20.0..40.0).contains(&x) && (20.0..40.0).contains(&y);
        if on_part {
            Some(0.0)
        } else {
            (noise.uniform() < 0.01).then(|| 80.0 * noise.uniform() - 40.0)
        }
    });
    let nodes = nodes(&image(&columns, &RegridSettings::with_pitch(0.4)));
    let stray = nodes
        .iter()
        .filter(|(x, y, _)| x.min(*y) < 19.5 || x.max(*y) > 40.5)
        .count();
    assert!(stray <= 2, "{stray} nodes away from the part");
    assert!(nodes.len() > 49 * 49);
}

/// Behind a near plate the far wall is in shadow for 3 mm: nothing is put there.
#[test]
fn an_occlusion_shadow_stays_empty() {
    let columns = scan(30.0, (0.4, 0.4), (0.3, 0.3), |x, _| {
        if x < 12.0 {
            Some(30.0)
        } else {
            (x > 15.0).then_some(0.0)
        }
    });
    let image = image(&columns, &RegridSettings::with_pitch(0.4));
    for (x, _, z) in nodes(&image) {
        assert!(z == 30.0 || z == 0.0, "{z}");
        assert!(!(12.4..14.6).contains(&x), "{x}");
    }
}

#[test]
fn a_corner_in_front_of_a_wall_is_not_punched_out() {
    let near = |x: f64, y: f64| x > 15.0 && y > 15.0;
    let columns = scan(30.0, (0.4, 0.4), (0.3, 0.3), |x, y| {
        Some(if near(x, y) { 20.0 } else { 0.0 })
    });
    let image = image(&columns, &RegridSettings::with_pitch(0.4));
    for i in 3..72 {
        for j in 3..72 {
            let (x, y) = (f64::from(i) * 0.4, f64::from(j) * 0.4);
            assert!(holds(&image, x, y), "hole at {x} {y}");
        }
    }
}

/// Rays fan out, so of a wall far behind a plate some samples lie beneath it along one edge, and
/// the other edge casts a shadow. Where the plate has nodes is its own affair.
#[test]
fn a_plate_ends_before_a_far_wall_as_it_does_before_nothing() {
    let is_plate = |x: f64, y: f64| {
        let y = y - 0.3 * x;
        (5.13..24.67).contains(&x) && (60.21..79.68).contains(&y)
    };
    let seen = |wall: bool| {
        let mut noise = Noise::new(7);
        let scan = columns(steps(0.1, 0.4, 75), |x| {
            // Slopes of rays from 400 mm before the plate.
            let mut samples: Vec<(f64, f64)> = steps(0.11, 0.001, 140)
                .filter_map(|slope| {
                    let z = 0.02 * noise.normal();
                    let y = 400.0 * slope;
                    if is_plate(x, y) {
                        Some((y, z))
                    } else {
                        wall.then_some((440.0 * slope, z - 40.0))
                    }
                })
                .collect();
            samples.sort_by(|s, t| s.0.total_cmp(&t.0));
            samples
        });
        let nodes = nodes(&image(&scan, &RegridSettings::with_pitch(0.4)));
        let between = nodes.iter().filter(|n| (-39.0..-1.0).contains(&n.2));
        assert_eq!(between.count(), 0, "wall {wall}");
        let of_plate = nodes.into_iter().filter(|n| n.2.abs() < 1.0);
        of_plate.map(|n| (n.0, n.1)).collect::<Vec<_>>()
    };
    let wrong = |nodes: &[(f64, f64)]| {
        let beyond = nodes.iter().filter(|n| !is_plate(n.0, n.1)).count();
        let inside = |k: i32| f64::from(k) * 0.4;
        let all = (0..75).flat_map(|i| (0..300).map(move |j| (inside(i), inside(j))));
        let all = all.filter(|n| is_plate(n.0, n.1)).count();
        (all - (nodes.len() - beyond), beyond)
    };
    let (alone, before_wall) = (wrong(&seen(false)), wrong(&seen(true)));
    assert!(alone.0 + alone.1 <= 20, "{alone:?}");
    // Of some 200 nodes along its outline.
    assert!(before_wall.0 + before_wall.1 <= 22, "{before_wall:?}");
}

#[test]
fn the_region_of_interest_limits_samples_and_nodes() {
    let columns = scan(30.0, (0.4, 0.4), (0.0, 0.0), |x, _| {
        Some(if x < 20.0 { 1.0 } else { 9.0 })
    });
    let settings = RegridSettings {
        roi: Roi {
            x_mm: (5.0, 25.0),
            y_mm: (8.0, f64::INFINITY),
            z_mm: (-5.0, 5.0),
        },
        ..RegridSettings::with_pitch(0.4)
    };
    let nodes = nodes(&image(&columns, &settings));
    let least =
        |value: fn(&(f64, f64, f64)) -> f64| nodes.iter().map(value).fold(f64::INFINITY, f64::min);
    assert!((5.0..5.5).contains(&least(|n| n.0)), "{}", least(|n| n.0));
    assert!((8.0..8.5).contains(&least(|n| n.1)));
    assert!((19.5..20.4).contains(&-least(|n| -n.0)));
    assert!(nodes.iter().all(|n| n.2 == 1.0));
}

#[test]
fn too_little_gives_an_empty_image() {
    let settings = RegridSettings::with_pitch(0.5);
    let none = image(&[], &settings);
    assert_eq!((none.columns(), none.rows()), (0, 0));
    let one = columns([1.0], |_| steps(0.0, 0.1, 100).map(|y| (y, 0.0)).collect());
    assert_eq!(image(&one, &settings).valid_nodes(), 0);
    let empty = columns(steps(0.0, 0.5, 20), |_| Vec::new());
    assert_eq!(image(&empty, &settings).valid_nodes(), 0);
    let line = columns(steps(0.0, 0.5, 20), |_| vec![(3.0, 1.0)]);
    assert_eq!(image(&line, &settings).valid_nodes(), 0);
}
