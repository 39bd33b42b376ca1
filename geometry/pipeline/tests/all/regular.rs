//! Regularities on the road from columns to a model.

use pipeline::{
    Kinds, Outcome, Reason, RegularityKind, Regularize, RegularizeSettings, Settings, process,
    process_columns,
};
use range_image::{Column, Sample, Unmonitored};
use shapes::{Shape, Verdict};

/// Noise of a fixed pattern, about normal, of deviation 1.
fn noise(i: i32, j: i32) -> f64 {
    let even = |k: f64| {
        let chance = libm::sin(f64::from(i) * 12.9898 + f64::from(j) * 78.233 + k) * 43758.5453;
        chance - chance.floor()
    };
    (0..12).map(|k| even(f64::from(k))).sum::<f64>() - 6.0
}

/// A roof whose two planes are square to each other but for `lean`, its ridge along y, with noise.
fn roof(lean_rad: f64, noise_mm: f64) -> Vec<Column> {
    let slope = |angle: f64| libm::tan(angle);
    let (left, right) = (
        slope(0.7),
        slope(core::f64::consts::FRAC_PI_2 - 0.7 + lean_rad),
    );
    (-60..=60)
        .map(|i| {
            let x_mm = f64::from(i) * 0.25;
            let samples = (-60..=60).map(|j| Sample {
                y_mm: f64::from(j) * 0.25,
                z_mm: 40.0
                    - if x_mm < 0.0 {
                        -x_mm * left
                    } else {
                        x_mm * right
                    }
                    + noise_mm * noise(i, j),
                intensity: 255,
            });
            Column::new(x_mm, samples.collect())
        })
        .collect()
}

fn settings(regularize: Regularize) -> Settings {
    Settings {
        regularize,
        ..Settings::new(0.5)
    }
}

fn on() -> Regularize {
    Regularize::On(RegularizeSettings::default())
}

fn made(columns: &[Column], settings: &Settings) -> Outcome {
    process_columns(columns, settings, &Unmonitored)
        .expect("a roof has faces")
        .1
}

fn normals(outcome: &Outcome) -> Vec<nalgebra::Vector3<f64>> {
    let shapes = outcome.kinds.iter().filter_map(|kind| kind.shape());
    shapes
        .filter_map(|shape| match shape {
            Shape::Plane(plane) => Some(plane.normal),
            _ => None,
        })
        .collect()
}

#[test]
fn a_roof_is_made_square_if_asked_and_its_faces_with_it() {
    let columns = roof(0.0, 0.02);
    let off = made(&columns, &settings(Regularize::Off));
    assert_eq!(off.regularities, None);
    let before = normals(&off);
    assert!(before[0].dot(&before[1]).abs() > 1e-6, "{before:?}");
    let outcome = made(&columns, &settings(on()));
    let found = outcome.regularities.as_ref().unwrap();
    assert_eq!(found.accepted.len(), 1, "{found:?}");
    assert_eq!(found.accepted[0].kind, RegularityKind::Perpendicular);
    let after = normals(&outcome);
    assert!(after[0].dot(&after[1]).abs() < 1e-10);
    // The evidence is that of the samples; what is told is what the faces are.
    for (kind, face) in outcome
        .kinds
        .iter()
        .zip(&outcome.reconstruction.model.faces)
    {
        let (shape, numbers) = kind.told().unwrap();
        assert_eq!(face.form, Some(shape.into()));
        let Verdict::Shape(fit) = &kind.evidence.verdict else {
            panic!("it is a shape");
        };
        assert_ne!(fit.shape, shape);
        let [was, is] = [&fit.numbers, &numbers].map(|n| n.direction_rad.unwrap().most());
        assert!(is <= was * (1.0 + 1e-9) && is > 0.0);
    }
    let again = made(&columns, &settings(on()));
    assert_eq!(again.regularities, outcome.regularities);
}

#[test]
fn a_roof_that_is_not_square_stays_as_it_is() {
    // A tenth of a degree: many times the uncertainty.
    let columns = roof(0.1_f64.to_radians(), 0.005);
    let outcome = made(&columns, &settings(on()));
    let found = outcome.regularities.as_ref().unwrap();
    assert_eq!(found.accepted, [], "{found:?}");
    assert!(outcome.kinds.iter().all(|kind| kind.adjusted.is_none()));
    assert!(found.refused.iter().all(|own| own.reason == Reason::TooFar));
    let off = made(&columns, &settings(Regularize::Off));
    assert_eq!(normals(&outcome), normals(&off));
}

#[test]
fn where_nothing_can_be_known_that_is_said() {
    let columns = roof(0.0, 0.02);
    let free = Settings {
        kinds: Kinds::FreeForm,
        ..settings(on())
    };
    let outcome = made(&columns, &free);
    let told = |outcome: &Outcome, what: &str| {
        assert!(outcome.kinds.iter().all(|kind| kind.adjusted.is_none()));
        let warnings = &outcome.reconstruction.warnings;
        assert!(
            warnings.iter().any(|own| own.contains(what)),
            "{warnings:?}"
        );
        assert_eq!(outcome.regularities.as_ref().unwrap().accepted, []);
    };
    told(&outcome, "faces are free forms");
    let image = regrid::regrid(columns, &settings(on()).regrid, &Unmonitored).unwrap();
    let outcome = process(&image, &settings(on()), &Unmonitored).unwrap();
    told(&outcome, "samples are not at hand");
    let wrong = settings(Regularize::On(RegularizeSettings {
        bound: 0.0,
        ..RegularizeSettings::default()
    }));
    let error = wrong.validate().unwrap_err().to_string();
    assert!(error.contains("bound of regularities"), "{error}");
}
