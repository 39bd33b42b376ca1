//! Edge points against curves whose edges are known in closed form.

use features::edges::{EdgeKind, EdgeSettings, edges, edges_of_columns};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Roughly normal: twelve uniform draws.
fn noise(random: &mut Xoshiro256PlusPlus) -> f64 {
    let unit =
        |random: &mut Xoshiro256PlusPlus| (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (0..12).map(|_| unit(random)).sum::<f64>() - 6.0
}

fn line(height: impl Fn(f64) -> f64, pitch: f64, sigma: f64, seed: u64) -> Vec<[f64; 2]> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let count = (40.0 / pitch) as usize;
    (0..count)
        .map(|k| {
            let u = pitch * k as f64;
            [u, height(u) + sigma * noise(&mut random)]
        })
        .collect()
}

fn found(line: &[[f64; 2]], sigma: f64) -> Vec<(f64, EdgeKind)> {
    let kinds = edges(line, &EdgeSettings::new(sigma));
    let places = line.iter().zip(kinds);
    places
        .filter_map(|(own, kind)| Some((own[0], kind?)))
        .collect()
}

/// A roof with its ridge at u = 20, sloping by 0.6 on both sides.
fn roof(u: f64) -> f64 {
    -0.6 * (u - 20.0).abs()
}

/// Level, an arc of radius 12 from u = 15 to 15 + 12 sin 40 degrees, then straight on.
fn fillet(u: f64) -> f64 {
    let (radius, angle) = (12.0, 40.0_f64.to_radians());
    let end = 15.0 + radius * libm::sin(angle);
    if u <= 15.0 {
        0.0
    } else if u <= end {
        radius - libm::sqrt(radius * radius - (u - 15.0) * (u - 15.0))
    } else {
        radius * (1.0 - libm::cos(angle)) + libm::tan(angle) * (u - end)
    }
}

#[test]
fn a_ridge_is_one_sharp_edge() {
    for (sigma, seed) in [(0.0, 1), (0.02, 2), (0.05, 3), (0.1, 4)] {
        let found = found(&line(roof, 0.5, sigma, seed), sigma);
        assert_eq!(found.len(), 1, "{sigma}: {found:?}");
        assert_eq!(found[0].1, EdgeKind::Sharp);
        assert!(
            (found[0].0 - 20.0).abs() <= 0.5 + 5.0 * sigma,
            "{sigma}: {found:?}"
        );
    }
}

#[test]
fn both_sides_of_a_jump_are_edges() {
    let step = |u: f64| if u < 20.2 { 0.0 } else { -3.0 };
    for (sigma, seed) in [(0.0, 5), (0.05, 6), (0.2, 7)] {
        let found = found(&line(step, 0.5, sigma, seed), sigma);
        let expected = [20.0, 20.5].map(|u| (u, EdgeKind::Sharp));
        assert_eq!(found, expected, "{sigma}");
    }
}

#[test]
fn an_arc_begins_and_ends_at_smooth_edges() {
    let end = 15.0 + 12.0 * libm::sin(40.0_f64.to_radians());
    for (sigma, seed) in [(0.0, 8), (0.005, 9), (0.01, 10)] {
        let found = found(&line(fillet, 0.25, sigma, seed), sigma);
        assert_eq!(found.len(), 2, "{sigma}: {found:?}");
        for ((place, kind), expected) in found.iter().zip([15.0, end]) {
            assert_eq!(*kind, EdgeKind::Smooth, "{sigma}: {found:?}");
            assert!(
                (place - expected).abs() <= 1.0,
                "{sigma}: {place} {expected}"
            );
        }
    }
}

#[test]
fn planes_and_arcs_have_no_edges() {
    let plane = |u: f64| 0.3 * u;
    let arc = |u: f64| libm::sqrt(60.0 * 60.0 - (u - 20.0) * (u - 20.0));
    let mut count = 0;
    for seed in 100..150 {
        count += found(&line(plane, 0.5, 0.05, seed), 0.05).len();
        count += found(&line(arc, 0.5, 0.05, seed), 0.05).len();
    }
    // Of 8000 points.
    assert!(count <= 2, "{count}");
}

#[test]
fn outliers_are_no_edges() {
    let mut points = line(|_| 0.0, 0.5, 0.05, 11);
    points[20][1] += 4.0;
    points[50][1] -= 1.0;
    points[60][1] = f64::NAN;
    assert_eq!(found(&points, 0.05), []);
    assert_eq!(found(&[], 0.05), []);
    assert_eq!(found(&[[0.0, 1.0]], 0.0), []);
}

/// A roof whose ridge runs along a column is not seen in any column, but across them.
#[test]
fn edges_are_found_across_columns_too() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(12);
    let columns: Vec<Vec<[f64; 3]>> = (0..80)
        .map(|i| {
            let x = 0.5 * f64::from(i);
            (0..30)
                .map(|j| {
                    // Not all columns begin at the same height.
                    let y = 0.5 * f64::from(j) + 0.05 * f64::from(i % 3);
                    [x, y, roof(x) + 0.02 * noise(&mut random)]
                })
                .collect()
        })
        .collect();
    let found = edges_of_columns(&columns, 0.5, &EdgeSettings::new(0.02));
    let mut on_ridge = 0;
    for (column, kinds) in columns.iter().zip(&found) {
        for (point, kind) in column.iter().zip(kinds) {
            if kind.is_some() {
                assert!((point[0] - 20.0).abs() <= 0.5, "{point:?}");
                on_ridge += 1;
            }
        }
    }
    assert_eq!(on_ridge, 30);
}
