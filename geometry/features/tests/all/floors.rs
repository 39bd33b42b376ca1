//! Floors that are part of spheres and cylinders, and such as are of neither.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;

use common::{Bench, recognised};
use features::feature::Bottom;
use features::floor::CurveKind;
use features::recognise::Recognition;

const TABLE_MM: f64 = -25.0;
const NOISE_MM: f64 = 0.05;

/// Scans a block turned by 5 degrees, with what is cut into it.
fn block(noise_mm: f64, table_mm: f64, floor_mm: &dyn Fn(f64, f64) -> Option<f64>) -> Recognition {
    let (sin, cos) = libm::sincos(5f64.to_radians());
    let part = |x: f64, y: f64| {
        let (u, v) = (cos * x + sin * y, cos * y - sin * x);
        if u.abs() > 45.0 || v.abs() > 28.0 {
            return table_mm;
        }
        floor_mm(u, v).unwrap_or(0.0)
    };
    let bench = Bench {
        y_mm: (-60.0, 60.0),
        noise_mm,
        ..Bench::default()
    };
    recognised(&bench, &part)
}

#[test]
fn the_radii_of_a_ball_and_of_a_groove_are_told() {
    radii_are_told(NOISE_MM);
}

#[test]
fn they_are_told_of_a_scan_without_noise() {
    radii_are_told(0.0);
}

fn radii_are_told(noise_mm: f64) {
    let found = block(noise_mm, TABLE_MM, &|u, v| {
        let [du, dv] = [u + 20.0, v];
        let from_ball = du * du + dv * dv;
        if from_ball < 144.0 {
            return Some(10.0 - (400.0 - from_ball).sqrt());
        }
        let is_groove = (5.0..35.0).contains(&u) && v.abs() < 9.0;
        is_groove.then(|| 22.0 - (900.0 - v * v).sqrt())
    });
    let curved: Vec<_> = (found.features.iter())
        .filter_map(|feature| Some((feature, feature.curve?)))
        .collect();
    assert_eq!(curved.len(), 2, "{:?}", found.features);
    for (feature, curve) in curved {
        let radius_mm = match curve.kind {
            CurveKind::Sphere => {
                // And not taken for the cone of a drill.
                assert!(matches!(feature.bottom, Bottom::FreeForm(_)));
                20.0
            }
            CurveKind::Cylinder(axis) => {
                // It runs along the slot.
                let along = feature.direction.unwrap();
                assert!(axis.dot(&along).abs() > 0.9999, "{axis} {along}");
                30.0
            }
        };
        let own = curve.radius;
        let error_mm = (own.value_mm - radius_mm).abs();
        assert!(error_mm < 3.0 * own.sigma_mm + 0.01, "{curve:?}");
        assert!(own.sigma_mm < 0.1 && curve.is_hollow, "{curve:?}");
    }
}

#[test]
fn a_wavy_floor_is_part_of_neither() {
    let found = block(NOISE_MM, TABLE_MM, &|u, v| {
        let is_pocket = u.abs() < 25.0 && v.abs() < 15.0;
        is_pocket.then(|| -8.0 + libm::sin(0.2 * u) * libm::cos(0.15 * v))
    });
    let wavy: Vec<_> = (found.features.iter())
        .filter(|feature| matches!(feature.bottom, Bottom::FreeForm(_)))
        .collect();
    assert_eq!(wavy.len(), 1, "{:?}", found.features);
    assert_eq!(wavy[0].curve, None);
}

#[test]
fn a_wall_that_hides_what_is_below_for_ten_samples_is_where_it_is() {
    // Beside a camera this low the table is seen again 4 mm, or ten samples, from the edge.
    let found = block(NOISE_MM, -45.0, &|_, _| None);
    let width = found.features[0].dimension("width").unwrap();
    assert!((width.value_mm - 56.0).abs() < 0.1, "{width:?}");
    assert!(width.sigma_mm < 0.1, "{width:?}");
}

#[test]
fn a_size_that_is_hardly_known_comes_with_a_warning() {
    // Nothing is seen beyond two of its walls: the rays end with the part.
    let part = |x: f64, y: f64| match x.abs() < 45.0 && y.abs() < 28.0 {
        true => 0.0,
        false => TABLE_MM,
    };
    let bench = Bench {
        y_mm: (-27.0, 27.0),
        ..Bench::default()
    };
    let found = recognised(&bench, &part);
    let block = &found.features[0];
    let width = block.dimension("width").unwrap();
    assert!((width.value_mm - 56.0).abs() > 1.0, "{width:?}");
    assert!(
        block.warnings.iter().any(|w| w.contains("known to")),
        "{block:?}"
    );
}
