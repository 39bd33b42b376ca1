//! Extrusions and revolutions on the whole road.

use nalgebra::Vector3;
use pipeline::{Outcome, Settings, process_columns};
use range_image::{Column, Sample, Unmonitored};
use shapes::{Form, Motion, Swept, Verdict};

const NOISE_MM: f64 = 0.03;

/// Columns 0.4 mm apart of z over a square of 40 mm, with noise.
fn columns(seed: u64, z_mm: impl Fn(f64, f64) -> Option<f64>) -> Vec<Column> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1);
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let column = |i: i32| {
        let x_mm = 0.4 * f64::from(i);
        let sample = |j: i32| {
            let y_mm = 0.4 * (f64::from(j) + uniform() - 0.5);
            let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let z_mm = z_mm(x_mm, y_mm)? + NOISE_MM * noise;
            Some(Sample {
                y_mm,
                z_mm,
                intensity: 255,
            })
        };
        Column::new(x_mm, (-50..=50).filter_map(sample).collect())
    };
    (-50..=50).map(column).collect()
}

fn wave(s: f64) -> f64 {
    1.5 * libm::sin(s / 4.0) + 0.8 * libm::cos(s / 7.0 + 0.5)
}

/// The one face that is swept, and what its region is said to be.
fn swept(outcome: &Outcome) -> Swept {
    let model = &outcome.reconstruction.model;
    let mut found = model.faces.iter().filter_map(|face| match &face.form {
        Some(Form::Swept(swept)) => Some((face, swept)),
        _ => None,
    });
    let (face, swept) = found.next().expect("a face is swept");
    assert!(found.next().is_none(), "no other is");
    let kind = &outcome.kinds[usize::from(face.region) - 1];
    assert!(matches!(&kind.evidence.verdict, Verdict::Swept(fit) if fit.swept == **swept));
    let fits = &outcome.reconstruction.regions;
    let fit = fits
        .iter()
        .find(|fit| fit.label == face.region)
        .expect("it has a fit");
    assert_eq!(
        Some(fit.parameters),
        kind.known().map(|known| known.freedom)
    );
    let coedges = face.outer.coedges.iter();
    for [x, y, z] in coedges.flat_map(|coedge| coedge.space_curve.sampled(50)) {
        let off_mm = swept.distance_mm(&Vector3::new(x, y, z)).abs();
        assert!(off_mm < 0.02, "{x} {y}: {off_mm}");
    }
    (**swept).clone()
}

#[test]
fn an_extrusion_beside_a_plane_is_a_face_of_its_profile() {
    let (sin, cos) = libm::sincos(0.3);
    let extruded = |x: f64, y: f64| wave(x * cos + y * sin) + 0.1 * (y * cos - x * sin);
    // A floor below the middle, which the extrusion ends above.
    let part = |x: f64, y: f64| Some(if y < -8.0 { -9.0 } else { extruded(x, y) });
    let (_, outcome) =
        process_columns(&columns(1, part), &Settings::new(0.4), &Unmonitored).unwrap();
    let found = swept(&outcome);
    assert_eq!(found.sweep.motion, Motion::Extrusion);
    let real = Vector3::new(-sin, cos, 0.1).normalize();
    assert!(found.sweep.axis.dot(&real).abs() > 1.0 - 1e-5);
    // To the border.
    for (x, y) in [(0.0, 0.0), (-19.0, 18.0), (19.0, 18.5), (-19.0, -7.0)] {
        let off_mm = found.z_mm(x, y, extruded(x, y)).unwrap() - extruded(x, y);
        assert!(off_mm.abs() < 0.03, "{x} {y}: {off_mm}");
    }
    let faces = &outcome.reconstruction.model.faces;
    let planes = faces.iter().filter_map(|face| face.form.as_ref()?.shape());
    assert_eq!((faces.len(), planes.count()), (2, 1));
}

#[test]
fn turned_parts_are_faces_of_their_profiles() {
    let baluster = |x: f64, y: f64| {
        let radius = 17.0 + wave(x);
        (y.abs() < 14.0).then(|| libm::sqrt(radius * radius - y * y))
    };
    let knob = |x: f64, y: f64| {
        let out = libm::sqrt(x * x + (y - 1.0).powi(2));
        (4.0..18.0).contains(&out).then(|| wave(out))
    };
    type Part<'a> = &'a dyn Fn(f64, f64) -> Option<f64>;
    for (part, axis, foot) in [
        (&baluster as Part<'_>, Vector3::x(), Vector3::zeros()),
        (&knob, Vector3::z(), Vector3::y()),
    ] {
        let (_, outcome) =
            process_columns(&columns(2, part), &Settings::new(0.4), &Unmonitored).unwrap();
        let found = swept(&outcome);
        assert_eq!(found.sweep.motion, Motion::Revolution);
        assert!(!found.is_hollow);
        assert!(found.sweep.axis.dot(&axis).abs() > 1.0 - 1e-5, "{axis}");
        let gap = foot - found.sweep.origin_mm;
        let gap_mm = (gap - axis * gap.dot(&axis)).norm();
        assert!(gap_mm < 0.03, "{axis}: {gap_mm}");
        assert_eq!(outcome.reconstruction.model.faces.len(), 1);
    }
}
