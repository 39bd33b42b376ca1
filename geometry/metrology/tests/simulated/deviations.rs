use metrology::calibrate::{CalibrateError, Place, References, Size};
use metrology::{Calibrated, Deviation, Scan, calibrate};

use crate::bench::Taken;

/// Five places across the measuring volume, near and far.
const PLACES: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [-45.0, -40.0, 25.0],
    [45.0, -40.0, -25.0],
    [-45.0, 40.0, -25.0],
    [45.0, 40.0, 25.0],
];
const MOUNT: &str = "angle-offset-deg=0.5,angle-scale=0.005,camera-y-mm=2,camera-z-mm=-2,\
                     plane-about-y-deg=0.4,plane-about-z-deg=-0.3,table-y-deg=0.2";

/// What that mount comes to in the frame of the laser plane, which is turned by 0.4 degrees about y
/// and then by -0.3 degrees about z: the camera at (0, 2, 748) mm is turned back along with all else.
fn truth(deviation: Deviation) -> f64 {
    let degrees = |angle: f64| angle * core::f64::consts::PI / 180.0;
    let ((sin_y, cos_y), (sin_z, cos_z)) =
        (libm::sincos(degrees(0.4)), libm::sincos(degrees(-0.3)));
    match deviation {
        Deviation::AngleOffset => degrees(0.5),
        Deviation::AngleScale => 0.005,
        Deviation::CameraX => cos_y * (sin_z * 2.0) - sin_y * 748.0,
        Deviation::CameraY => cos_z * 2.0,
        Deviation::CameraZ => sin_y * (sin_z * 2.0) + cos_y * 748.0 - 750.0,
        Deviation::TableY => degrees(0.2 + 0.3),
        Deviation::TableZ | Deviation::PlaneAboutY => degrees(0.4),
        Deviation::PlaneAboutZ => degrees(-0.3),
        Deviation::RangeOffset | Deviation::RangeScale | Deviation::TableScale => 0.0,
    }
}

fn spheres() -> References {
    References {
        sphere_diameter_mm: Some(25.4),
        ..References::default()
    }
}

fn scans(seed: u64, places: &[[f64; 3]]) -> Vec<Scan> {
    (seed..)
        .zip(places)
        .map(|(seed, &place)| Taken::of("sphere", MOUNT, seed).at(&[place]).scan())
        .collect()
}

fn names(told: &Calibrated) -> Vec<&'static str> {
    told.determined.iter().map(|d| d.deviation.name()).collect()
}

#[test]
fn deviations_are_found_within_their_uncertainties() {
    let mut pulls = Vec::new();
    for run in 0..8 {
        let told = calibrate(&scans(1000 * run, &PLACES), &spheres()).unwrap();
        let all = told.determined.iter().chain(&told.insignificant);
        for own in all.clone() {
            pulls.push((own.value - truth(own.deviation)) / own.uncertainty);
        }
        assert_eq!(names(&told)[0], "angle scale");
        assert_eq!(all.count(), 4, "and the table's two directions and scale");
        for own in &told.insignificant {
            assert_eq!(told.deviations.get(own.deviation), 0.0);
            assert!(own.value.abs() < 2.0 * own.uncertainty, "{own:?}");
        }
        // What is not determined stays at zero, and moves and turns all as one.
        for own in &told.undetermined {
            assert_eq!(told.deviations.get(own.deviation), 0.0);
        }
        assert_eq!(told.undetermined[0].deviation, Deviation::AngleOffset);
        assert_eq!(told.undetermined[0].uncertainty, None);
        for seen in &told.seen {
            let Size::Sphere { error_mm, .. } = &seen.size else {
                panic!("there is no gauge");
            };
            assert!(
                error_mm[0] < -0.06 && error_mm[1].abs() < 0.04,
                "{error_mm:?}"
            );
        }
        assert!(told.rms_mm[1] < told.rms_mm[0] && told.rms_mm[1] < 0.055);
    }
    let count = pulls.len() as f64;
    let rms = libm::sqrt(pulls.iter().map(|p| p * p).sum::<f64>() / count);
    let mean = pulls.iter().sum::<f64>() / count;
    assert!((0.6..1.5).contains(&rms), "{rms} {pulls:?}");
    assert!(mean.abs() < 0.6, "{mean} {pulls:?}");
}

#[test]
fn a_scanner_that_is_mounted_as_it_says_is_left_alone() {
    let scans: Vec<Scan> = (70..)
        .zip(&PLACES)
        .map(|(seed, &place)| Taken::of("sphere", "", seed).at(&[place]).scan())
        .collect();
    let told = calibrate(&scans, &spheres()).unwrap();
    assert!(told.determined.len() <= 1, "{:?}", told.determined);
    assert!(told.insignificant.len() >= 3, "{:?}", told.insignificant);
    assert!(
        (told.rms_mm[1] - told.rms_mm[0]).abs() < 2e-4,
        "{:?}",
        told.rms_mm
    );
}

#[test]
fn known_places_tell_where_the_camera_is() {
    let mut known = spheres();
    known.places = PLACES
        .iter()
        .map(|&at_mm| Place {
            at_mm,
            uncertainty_mm: 0.005,
        })
        .collect();
    let told = calibrate(&scans(7, &PLACES), &known).unwrap();
    let undetermined: Vec<_> = told.undetermined.iter().map(|u| u.deviation).collect();
    assert_eq!(undetermined, [Deviation::RangeOffset]);
    for own in told.determined.iter().chain(&told.insignificant) {
        let pull = (own.value - truth(own.deviation)) / own.uncertainty;
        assert!(pull.abs() < 4.0, "{own:?} {pull}");
    }
    let offset = told.determined[0];
    assert!(offset.deviation == Deviation::AngleOffset && offset.uncertainty < 2e-4);
    // The angle's offset and the camera's height do nearly the same.
    let pair = (Deviation::AngleOffset, Deviation::CameraY);
    assert!(told.correlated.iter().any(|&(a, b, _)| (a, b) == pair));

    // A known place that is not where the sphere is.
    let elsewhere = scans(7, &[[0.0, 0.0, 60.0], PLACES[1], PLACES[2]]);
    let error = calibrate(&elsewhere, &known).unwrap_err();
    assert!(
        matches!(error, CalibrateError::NoPlace { scan: 0, .. }),
        "{error}"
    );
}

#[test]
fn one_scan_with_several_spheres_is_enough() {
    let mut taken = Taken::of("spheres", MOUNT, 3);
    taken.overrides.columns = Some(480);
    taken.overrides.samples = Some(512);
    let told = calibrate(&[taken.scan()], &spheres()).unwrap();
    assert_eq!(told.seen.len(), 5);
    let scale = told.determined[0];
    assert_eq!(scale.deviation, Deviation::AngleScale);
    assert!(
        (scale.value - 0.005).abs() < 4.0 * scale.uncertainty,
        "{scale:?}"
    );
}

#[test]
fn a_step_gauge_tells_the_scale_along_its_steps() {
    let mount = "range-scale=0.004,angle-offset-deg=0.3";
    let mut taken = Taken::of("step-gauge", mount, 11);
    taken.artefact.tilt_deg = (6.0, -4.0);
    let gauge = References {
        step_heights_mm: Some(sim_scanner::scene::artefacts::STEP_HEIGHTS_MM.to_vec()),
        ..References::default()
    };
    let told = calibrate(&[taken.scan()], &gauge).unwrap();
    let scale = told
        .determined
        .iter()
        .find(|own| own.deviation == Deviation::RangeScale)
        .unwrap();
    assert!(scale.uncertainty < 5e-4, "{scale:?}");
    assert!(
        (scale.value - 0.004).abs() < 4.0 * scale.uncertainty,
        "{scale:?}"
    );
    let Size::Steps { heights, error_mm } = &told.seen[0].size else {
        panic!("it is a gauge");
    };
    assert_eq!(*heights, 5);
    assert!(
        error_mm[0] < -0.14 && error_mm[1].abs() < 0.015,
        "{error_mm:?}"
    );
}

#[test]
fn what_cannot_be_calibrated_with_is_refused() {
    let told = |scans: &[Scan]| calibrate(scans, &spheres()).unwrap_err();
    // The same place three times over is one.
    let twice = scans(1, &[PLACES[0], PLACES[0], PLACES[1]]);
    assert_eq!(told(&twice), CalibrateError::TooFew { places: 2 });
    let mut mixed = scans(1, &PLACES[..3]);
    mixed[1].calibration.table_count_mm *= 2.0;
    assert_eq!(told(&mixed), CalibrateError::OtherCalibration { scan: 1 });
    let mut cut = scans(1, &PLACES[..3]);
    let half = cut[2].columns.len() / 2;
    cut[2].columns.truncate(half);
    assert_eq!(told(&cut), CalibrateError::CutOff { scan: 2 });
    let mut other = scans(1, &PLACES[..3]);
    other[0] = Taken::of("plate", MOUNT, 1).scan();
    assert_eq!(told(&other), CalibrateError::NothingSeen { scan: 0 });
    let house = calibrate(&[Taken::of("house", MOUNT, 1).scan()], &spheres());
    assert_eq!(house, Err(CalibrateError::NothingSeen { scan: 0 }));
    let nothing = calibrate(&other, &References::default());
    assert_eq!(nothing, Err(CalibrateError::NothingGiven));
}
