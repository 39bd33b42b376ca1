//! The paper's objects are what they are: planes, a disc and a cylinder, with every number as
//! near to the truth as it says. `cargo xtask study shapes` asks the same of 60 scenes.

#![allow(clippy::panic, reason = "a test that cannot go on says where")]

use nalgebra::Vector3;
use pipeline::{Basis, Outcome, Settings, process_columns};
use range_image::Unmonitored;
use relief_tests::columns::received;
use shapes::{Fit, Shape, Verdict};
use sim_scanner::preset::{self, Overrides, Preset};
use sim_scanner::scene::{Body, Surface};

/// Took no part in tuning. One in the first tier; `RELIEF_SEEDS` asks for more, as `cargo xtask full` does.
fn seeds() -> std::ops::Range<u64> {
    let wanted = std::env::var("RELIEF_SEEDS").ok();
    let count = wanted.and_then(|text| text.parse().ok()).unwrap_or(1);
    201..201 + count
}

/// What a number may be off by, in its standard uncertainties: one in a thousand is off by
/// more than three, and there are some forty.
const FARTHEST: f64 = 4.0;
/// Greatest standard uncertainty of a length.
const SURE_MM: f64 = 0.03;

/// What the scan of an object came to, and what the object's faces are.
fn scanned(name: &str, seed: u64) -> (Outcome, Vec<Surface>) {
    let scene = preset::object(name, Preset::Paper.material()).expect("built in");
    let faces = match &scene.bodies[0].0 {
        Body::Solid(solid) => solid.faces().to_vec(),
        Body::Mesh(_) => Vec::new(),
    };
    let overrides = Overrides {
        outliers: Some(0.02),
        ..Overrides::default()
    };
    let (scanner, sweep) = Preset::Paper
        .set_up(scene, &overrides, seed)
        .expect("a built-in scene fits");
    let columns: Vec<_> = (0..sweep.columns)
        .map(|index| received(&scanner, &scanner.column(&sweep, 0, index)))
        .collect();
    let settings = Settings::new(0.45).with_seed(seed);
    let (_, outcome) = process_columns(&columns, &settings, &Unmonitored).expect("there is a part");
    (outcome, faces)
}

fn fits(outcome: &Outcome) -> Vec<&Fit> {
    let fits = outcome.kinds.iter().map(|kind| {
        assert_eq!(kind.basis, Basis::Samples);
        match &kind.evidence.verdict {
            Verdict::Shape(fit) => &**fit,
            other => panic!("region {} is {other:?}", kind.label),
        }
    });
    fits.collect()
}

/// Holds a plane to that of the faces whose normal is nearest.
fn check_plane(fit: &Fit, faces: &[Surface]) {
    let Shape::Plane(plane) = &fit.shape else {
        panic!("no plane: {:?}", fit.shape);
    };
    let planes = faces.iter().filter_map(|face| match *face {
        Surface::Plane { normal, offset_mm } => {
            Some((Vector3::new(normal.x, normal.y, normal.z), offset_mm))
        }
        _ => None,
    });
    let nearness = |normal: &Vector3<f64>| normal.dot(&plane.normal);
    let (normal, offset_mm) = planes
        .max_by(|a, b| nearness(&a.0).total_cmp(&nearness(&b.0)))
        .expect("the object has planes");
    let off_mm = normal.dot(&plane.point_mm) - offset_mm;
    let sure_mm = fit.numbers.place_mm.along(&normal);
    assert!(off_mm.abs() < FARTHEST * sure_mm, "{off_mm} +- {sure_mm}");
    assert!(sure_mm < SURE_MM, "{sure_mm}");
    let spread = fit.numbers.direction_rad.expect("a plane has one");
    let tilt_rad = normal.cross(&plane.normal).norm();
    assert!(
        tilt_rad < FARTHEST * spread.most(),
        "{tilt_rad} +- {spread:?}"
    );
}

#[test]
fn the_house_is_of_four_planes() {
    for seed in seeds() {
        let (outcome, faces) = scanned("house", seed);
        let fits = fits(&outcome);
        assert_eq!(fits.len(), 4);
        for fit in fits {
            check_plane(fit, &faces);
        }
    }
}

#[test]
fn the_cylinder_is_of_a_disc_and_a_cylinder() {
    for seed in seeds() {
        let (outcome, faces) = scanned("cylinder", seed);
        let fits = fits(&outcome);
        let round = |fit: &&Fit| matches!(fit.shape, Shape::Cylinder(_));
        let (sides, discs): (Vec<&Fit>, Vec<&Fit>) = fits.into_iter().partition(round);
        assert_eq!((sides.len(), discs.len()), (1, 1));
        check_plane(discs[0], &faces);
        let real_mm = faces.iter().find_map(|face| match *face {
            Surface::Cylinder { radius_mm, .. } => Some(radius_mm),
            _ => None,
        });
        let radius = sides[0].numbers.radius_mm.expect("a cylinder has one");
        let off_mm = radius.value - real_mm.expect("so has the object's");
        assert!(
            off_mm.abs() < FARTHEST * radius.deviation,
            "{radius:?} is off by {off_mm}"
        );
        assert!(radius.deviation < SURE_MM, "{radius:?}");
    }
}
