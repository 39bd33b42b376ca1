//! Extrusions and revolutions are written by their profiles.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{self, AnalyticSurface, Entities, TrimmedSurface};
use cad_exchange::step::{self, LengthUnit, StepSurface};
use nalgebra::{Rotation3, Unit, Vector3};
use nurbs::PiecewiseCubic;
use reconstruct::Model;
use shapes::{Form, Motion, Sweep, Swept};

const SAMPLES: [&str; 4] = [
    "extrusion",
    "revolution",
    "hollow-revolution",
    "ring-revolution",
];

fn form(model: &Model) -> &Form {
    model.faces[0].form.as_ref().unwrap()
}

fn stepped(model: &Model, unit: LengthUnit) -> step::StepModel {
    let options = step::WriteOptions {
        unit,
        ..step::WriteOptions::new("part", "2026-11-21T09:30:00")
    };
    let mut file = Vec::new();
    step::write(model, &options, &mut file).unwrap();
    let read = step::read_model(&file[..]).unwrap();
    assert!(read.unknown.is_empty(), "{:?}", read.unknown);
    read
}

/// What is said of a sample's STEP file in which some text is another.
fn refusal(name: &str, from: &str, to: &str) -> String {
    let model = sample::of_shape(name).unwrap();
    let options = step::WriteOptions::new("part", "2026-11-21T09:30:00");
    let mut file = Vec::new();
    step::write(&model, &options, &mut file).unwrap();
    let text = String::from_utf8(file).unwrap();
    assert!(text.contains(from), "{from}");
    let changed = text.replacen(from, to, 1);
    step::read_model(changed.as_bytes())
        .unwrap_err()
        .to_string()
}

fn igesed(model: &Model, entities: Entities) -> iges::TrimmedModel {
    let options = iges::WriteOptions {
        entities,
        ..iges::WriteOptions::new("part", "20261121.093000")
    };
    let mut file = Vec::new();
    iges::write(model, &options, &mut file).unwrap();
    iges::read_model(&file[..]).unwrap()
}

/// Places of a curve.
fn places(evaluate: impl Fn(f64) -> [f64; 3], (first, last): (f64, f64)) -> Vec<Vector3<f64>> {
    let at = |k: u32| first + (last - first) * f64::from(k) / 40.0;
    (0..=40).map(|k| evaluate(at(k)).into()).collect()
}

/// Holds the places of a profile, moved by what sweeps it, to the form, and the normal that the two
/// make to that of the face.
fn assert_swept(
    form: &Form,
    profile: &[Vector3<f64>],
    moved: impl Fn(&Vector3<f64>, f64) -> Vector3<f64>,
    is_profile_first: bool,
) {
    let mut seen = 0;
    for pair in profile.windows(2) {
        for share in [0.0, 0.3, 0.5, 0.8] {
            let at = moved(&pair[0], share);
            assert!(form.distance_mm(&at).abs() < 1e-8, "{at:?}");
            let along = moved(&pair[1], share) - at;
            let sweep = moved(&pair[0], share + 1e-4) - at;
            let normal = if is_profile_first {
                along.cross(&sweep)
            } else {
                sweep.cross(&along)
            };
            let cosine = normal.normalize().dot(&form.normal(&at));
            assert!(cosine > 0.9, "{at:?}: {cosine}");
            seen += usize::from(form.normal(&at).z > 0.3);
        }
    }
    assert!(seen >= 40, "the camera sees it: {seen}");
}

fn turned(axis: Vector3<f64>, origin: Vector3<f64>, at: &Vector3<f64>, share: f64) -> Vector3<f64> {
    let angle = core::f64::consts::TAU * share;
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle);
    origin + turn * (at - origin)
}

#[test]
fn step_has_the_profile_and_what_sweeps_it() {
    for name in SAMPLES {
        for unit in [LengthUnit::Millimetre, LengthUnit::Inch] {
            let model = sample::of_shape(name).unwrap();
            let form = form(&model);
            let read = stepped(&model, unit);
            for edge in &read.edges {
                for at in places(|t| edge.curve.evaluate(t), edge.curve.knots().domain()) {
                    let off_mm = form.distance_mm(&at);
                    assert!(off_mm.abs() <= read.uncertainty_mm, "{name}: {off_mm}");
                }
            }
            let face = &read.faces[0];
            assert!(face.same_sense, "{name}");
            match &face.surface {
                StepSurface::Extrusion { profile, along_mm } => {
                    assert_eq!(name, "extrusion");
                    let profile = places(|t| profile.evaluate(t), profile.knots().domain());
                    let along = Vector3::from(*along_mm);
                    assert!(along.norm() > 8.0, "beyond the face: {along}");
                    assert_swept(form, &profile, |at, share| at + along * share, true);
                }
                StepSurface::Revolution {
                    profile,
                    origin_mm,
                    axis,
                } => {
                    assert!(name.ends_with("revolution"));
                    let profile = places(|t| profile.evaluate(t), profile.knots().domain());
                    let (axis, origin) = (Vector3::from(*axis), Vector3::from(*origin_mm));
                    let moved = |at: &Vector3<f64>, share| turned(axis, origin, at, share);
                    assert_swept(form, &profile, moved, false);
                    if name != "ring-revolution" {
                        assert!(form.normal(&profile[20]).z < 0.0, "the seam is behind");
                    }
                }
                other => panic!("{name}: {other:?}"),
            }
            // A ring is one loop once it is cut open.
            assert_eq!(face.inner.len(), 0, "{name}");
        }
    }
}

#[test]
fn iges_has_them_too() {
    for name in SAMPLES {
        for entities in [Entities::Analytic, Entities::Boundary] {
            let model = sample::of_shape(name).unwrap();
            let form = form(&model);
            let read = igesed(&model, entities);
            for curve in &read.faces[0].outer {
                assert_eq!(curve.parameter_curve, None);
                let curve = &curve.space_curve;
                for at in places(|t| curve.evaluate(t), curve.domain()) {
                    assert!(form.distance_mm(&at).abs() <= read.resolution_mm, "{name}");
                }
            }
            match &read.faces[0].surface {
                TrimmedSurface::Analytic(AnalyticSurface::Extrusion { profile, end_mm }) => {
                    assert_eq!(name, "extrusion");
                    let profile = places(|t| profile.evaluate(t), profile.domain());
                    let along = Vector3::from(*end_mm) - profile[0];
                    assert!(along.norm() > 8.0, "beyond the face: {along}");
                    assert_swept(form, &profile, |at, share| at + along * share, true);
                }
                TrimmedSurface::Analytic(AnalyticSurface::Revolution {
                    profile,
                    axis_mm,
                    angles_rad,
                }) => {
                    assert!(name.ends_with("revolution"));
                    assert_eq!(*angles_rad, [0.0, core::f64::consts::TAU]);
                    let profile = places(|t| profile.evaluate(t), profile.domain());
                    let [origin, to] = axis_mm.map(Vector3::from);
                    let moved = |at: &Vector3<f64>, share| turned(to - origin, origin, at, share);
                    assert_swept(form, &profile, moved, true);
                }
                other => panic!("{name}: {other:?}"),
            }
        }
        // What knows no such surfaces has splines.
        let model = sample::of_shape(name).unwrap();
        let read = igesed(&model, Entities::Rational128);
        assert!(matches!(read.faces[0].surface, TrimmedSurface::BSpline(_)));
    }
}

#[test]
fn what_cannot_be_written_by_its_profile_is_a_spline() {
    let swept = |motion, axis, [first, last]: [f64; 2], t: f64| Swept {
        sweep: Sweep::new(motion, Vector3::zeros(), axis).unwrap(),
        profile: PiecewiseCubic::new(vec![first, last], vec![[[t, 0.0, 0.0, 0.01]]]).unwrap(),
        is_hollow: false,
    };
    for (of, is_written) in [
        // The whole face lies beside the profile, then a part of it beyond.
        (
            swept(Motion::Extrusion, Vector3::y(), [-6.0, 6.0], 0.0),
            true,
        ),
        (
            swept(Motion::Extrusion, Vector3::y(), [-6.0, 4.5], 0.0),
            false,
        ),
        // The axis goes through the face, or beside it.
        (
            swept(Motion::Revolution, Vector3::z(), [-9.0, 9.0], 0.0),
            false,
        ),
        (
            swept(Motion::Revolution, Vector3::y(), [-9.0, 9.0], 20.0),
            true,
        ),
    ] {
        let graph = of.clone();
        let z_mm = |x, y| graph.z_mm(x, y, 30.0).unwrap();
        let model = sample::rectangle([-3.0, 5.0], [-4.0, 4.0], of.clone(), z_mm);
        let read = stepped(&model, LengthUnit::Millimetre);
        let is_spline = matches!(read.faces[0].surface, StepSurface::BSpline(_));
        assert_eq!(is_spline, !is_written, "{of:?}");
    }
}

#[test]
fn what_is_damaged_is_told() {
    let told = refusal("extrusion", "=VECTOR('',", "=VECTOR('',$,");
    assert!(told.contains("VECTOR (#"), "{told}");
    let told = refusal("revolution", "=AXIS1_PLACEMENT(", "=AXIS2_PLACEMENT_3D(");
    assert!(told.contains("expected AXIS1_PLACEMENT"), "{told}");
    let told = refusal(
        "revolution",
        "=B_SPLINE_CURVE_WITH_KNOTS('',3,",
        "=LINE('',3,",
    );
    assert!(
        told.contains("expected B_SPLINE_CURVE_WITH_KNOTS"),
        "{told}"
    );
}
