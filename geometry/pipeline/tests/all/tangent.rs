//! Smooth joins on the road from columns to a model.

use pipeline::{Outcome, RegularityKind, Settings, SmoothJoins, process_columns};
use range_image::{Column, Sample, Unmonitored};
use shapes::{Cylinder, Plane, Shape};

const RADIUS_MM: f64 = 6.0;
const RAMP_RAD: f64 = 0.8;
const NOISE_MM: f64 = 0.02;

/// Noise of a fixed pattern, about normal, of deviation 1.
fn noise(i: i32, j: i32) -> f64 {
    let even = |k: f64| {
        let chance = libm::sin(f64::from(i) * 12.9898 + f64::from(j) * 78.233 + k) * 43758.5453;
        chance - chance.floor()
    };
    (0..12).map(|k| even(f64::from(k))).sum::<f64>() - 6.0
}

/// The floor up to x = 0, a fillet, a ramp.
fn height_mm(x_mm: f64) -> f64 {
    let (sin, cos) = libm::sincos(RAMP_RAD);
    if x_mm <= 0.0 {
        0.0
    } else if x_mm <= RADIUS_MM * sin {
        RADIUS_MM - (RADIUS_MM * RADIUS_MM - x_mm * x_mm).sqrt()
    } else {
        RADIUS_MM * (1.0 - cos) + (x_mm - RADIUS_MM * sin) * sin / cos
    }
}

fn made(smooth_joins: SmoothJoins) -> Outcome {
    let columns: Vec<Column> = (-60..=80)
        .map(|i| {
            let x_mm = f64::from(i) * 0.25;
            let samples = (-60..=60).map(|j| Sample {
                y_mm: f64::from(j) * 0.25,
                z_mm: 40.0 + height_mm(x_mm) + NOISE_MM * noise(i, j),
                intensity: 255,
            });
            Column::new(x_mm, samples.collect())
        })
        .collect();
    let settings = Settings {
        smooth_joins,
        ..Settings::new(0.5)
    };
    process_columns(&columns, &settings, &Unmonitored)
        .expect("it has faces")
        .1
}

fn shapes(outcome: &Outcome) -> (Vec<Plane>, Vec<Cylinder>) {
    let (mut planes, mut cylinders) = (Vec::new(), Vec::new());
    for shape in outcome.kinds.iter().filter_map(|kind| kind.shape()) {
        match shape {
            Shape::Plane(plane) => planes.push(plane),
            Shape::Cylinder(cylinder) => cylinders.push(cylinder),
            _ => {}
        }
    }
    (planes, cylinders)
}

#[test]
fn a_fillet_touches_the_planes_beside_it() {
    let outcome = made(SmoothJoins::Split);
    let (planes, cylinders) = shapes(&outcome);
    assert_eq!(outcome.kinds.len(), 3);
    assert_eq!((planes.len(), cylinders.len()), (2, 1));
    let accepted = &outcome.tangent.accepted;
    assert_eq!(accepted.len(), 2, "{:?}", outcome.tangent);
    assert!(
        accepted
            .iter()
            .all(|own| own.kind == RegularityKind::Tangent)
    );
    assert_eq!(outcome.regularities, None);
    let fillet = &cylinders[0];
    for plane in &planes {
        let height_mm = plane.normal.dot(&(fillet.point_mm - plane.point_mm));
        assert!(fillet.axis.dot(&plane.normal).abs() < 1e-9);
        assert!((height_mm.abs() - fillet.radius_mm).abs() < 1e-6);
    }
    let told = outcome
        .kinds
        .iter()
        .find_map(|kind| kind.told()?.1.radius_mm);
    let radius = told.expect("a cylinder has one");
    let off = (radius.value - RADIUS_MM) / radius.deviation;
    assert!(off.abs() < 3.0 && radius.deviation < 0.02, "{radius:?}");
}

#[test]
fn what_is_kept_whole_touches_nothing() {
    let outcome = made(SmoothJoins::Keep);
    assert_eq!(outcome.tangent, pipeline::Tangent::default());
    assert!(outcome.kinds.iter().all(|kind| kind.adjusted.is_none()));
}
