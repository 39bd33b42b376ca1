//! Surfaces of extrusion and revolution, found where they are known.

use crate::known;

use nalgebra::Vector3;
use shapes::{Motion, Sample, SweptFit, swept};

use known::{NOISE_MM, Random};

/// Share of the samples that lie anywhere.
const OUTLIERS: f64 = 0.02;

/// Samples of z over a square about the origin, seen from above, with outliers among them.
fn seen(count: usize, half_mm: f64, seed: u64, z_mm: impl Fn(f64, f64) -> f64) -> Vec<Sample> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(3));
    (0..count)
        .map(|_| {
            let [x, y] = [0, 1].map(|_| half_mm * (2.0 * random.uniform() - 1.0));
            let z = if random.uniform() < OUTLIERS {
                40.0 * random.uniform() - 20.0
            } else {
                z_mm(x, y) + NOISE_MM * random.normal()
            };
            Sample {
                point_mm: Vector3::new(x, y, z),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM,
            }
        })
        .collect()
}

/// A wave that is no circle anywhere.
fn wave(s: f64) -> f64 {
    1.5 * libm::sin(s / 4.0) + 0.8 * libm::cos(s / 7.0 + 0.5)
}

/// Shifted along a direction across the image that climbs a little.
fn extruded(x: f64, y: f64) -> f64 {
    let (sin, cos) = libm::sincos(0.4);
    wave(x * cos + y * sin) + 0.1 * (y * cos - x * sin)
}

fn extrusion() -> Vector3<f64> {
    let (sin, cos) = libm::sincos(0.4);
    Vector3::new(-sin, cos, 0.1).normalize()
}

const FOOT: [f64; 2] = [3.0, -2.0];

/// Turned about an axis towards the scanner.
fn dish(x: f64, y: f64) -> f64 {
    let out = libm::sqrt((x - FOOT[0]).powi(2) + (y - FOOT[1]).powi(2));
    wave(out)
}

/// A baluster that lies on its side, its axis along x.
fn baluster(x: f64, y: f64) -> f64 {
    (baluster_radius(x).powi(2) - (y - 1.0).powi(2)).sqrt() - 20.0
}

fn baluster_radius(x: f64) -> f64 {
    17.0 + wave(x)
}

/// Half of the mould of it.
fn mould(x: f64, y: f64) -> f64 {
    -baluster(x, y)
}

/// How far the direction is off, in its standard uncertainties, in two ways square to it.
fn off(fit: &SweptFit, real: &Vector3<f64>) -> [f64; 2] {
    let axis = fit.swept.sweep.axis;
    let real = if axis.dot(real) < 0.0 { -real } else { *real };
    fit.swept.sweep.across().map(|way| {
        let variance = way.dot(&(fit.direction_rad.covariance * way));
        (real - axis).dot(&way) / variance.sqrt()
    })
}

/// Holds numbers that should be normal with deviation 1 to that.
fn assert_normal(what: &str, offs: &[f64]) {
    let within = offs.iter().filter(|off| off.abs() < 1.96).count();
    let share = within as f64 / offs.len() as f64;
    assert!(
        share >= 0.85,
        "{what}: {within} of {}: {offs:?}",
        offs.len()
    );
    let most = offs.iter().fold(0.0, |most: f64, off| most.max(off.abs()));
    assert!(most < 4.5, "{what}: {offs:?}");
    assert!(offs.iter().any(|off| off.abs() > 0.5), "{what}: {offs:?}");
}

#[test]
fn extrusions_are_found_with_their_directions() {
    let mut offs = Vec::new();
    for seed in 0..12 {
        let samples = seen(3000, 20.0, seed, extruded);
        let fit = swept(&samples, 1.0).unwrap();
        assert_eq!(fit.swept.sweep.motion, Motion::Extrusion, "{seed}");
        assert!(!fit.swept.is_hollow && fit.place_mm.is_none());
        // Noise is along z, and the surface slopes.
        let share = fit.rms_mm / NOISE_MM;
        assert!((0.9..1.03).contains(&share), "{share}");
        assert!(
            fit.held > 2900 && fit.freedom < 40,
            "{} {}",
            fit.held,
            fit.freedom
        );
        offs.extend(off(&fit, &extrusion()));
        let mut squares = 0.0;
        for (x, y) in (0..400).map(|k| (f64::from(k % 20) - 9.5, f64::from(k / 20) - 9.5)) {
            let z = fit.swept.z_mm(x, y, 0.0).unwrap();
            let place = Vector3::new(x, y, z);
            assert!(fit.swept.distance_mm(&place).abs() < 1e-9);
            assert!(fit.swept.normal(&place).z > 0.5);
            squares += (z - extruded(x, y)).powi(2);
        }
        let rms_mm = (squares / 400.0_f64).sqrt();
        // About one coefficient in a hundred samples.
        assert!(rms_mm < 3.0 * fit.profile_deviation_mm, "{rms_mm}");
        assert!((0.002..0.01).contains(&fit.profile_deviation_mm));
    }
    assert_normal("directions", &offs);
}

#[test]
fn revolutions_are_found_with_their_axes() {
    for (name, real, place, is_hollow, z_mm) in [
        (
            "dish",
            Vector3::z(),
            Vector3::new(FOOT[0], FOOT[1], 0.0),
            false,
            dish as fn(f64, f64) -> f64,
        ),
        (
            "baluster",
            Vector3::x(),
            Vector3::new(0.0, 1.0, -20.0),
            false,
            baluster,
        ),
        (
            "mould",
            Vector3::x(),
            Vector3::new(0.0, 1.0, 20.0),
            true,
            mould,
        ),
    ] {
        let (mut directions, mut places) = (Vec::new(), Vec::new());
        for seed in 0..12 {
            let samples = seen(3000, 12.0, seed + 100, z_mm);
            let Some(fit) = swept(&samples, 1.0) else {
                panic!("{name} {seed} is not found");
            };
            let sweep = &fit.swept.sweep;
            assert_eq!(sweep.motion, Motion::Revolution, "{name} {seed}");
            assert_eq!(fit.swept.is_hollow, is_hollow, "{name} {seed}");
            let share = fit.rms_mm / NOISE_MM;
            assert!((0.8..1.03).contains(&share), "{share}");
            directions.extend(off(&fit, &real));
            let spread = fit.place_mm.unwrap();
            let gap = place - sweep.origin_mm;
            let gap = gap - real * (gap.dot(&sweep.axis) / real.dot(&sweep.axis));
            for way in sweep.across() {
                let variance = way.dot(&(spread.covariance * way));
                places.push(gap.dot(&way) / variance.sqrt());
            }
            let near_mm = z_mm(4.0, 3.0);
            let z = fit.swept.z_mm(4.0, 3.0, near_mm).unwrap();
            assert!((z - near_mm).abs() < 0.03, "{name} {seed}: {z} {near_mm}");
            let normal = fit.swept.normal(&Vector3::new(4.0, 3.0, z));
            assert!(normal.z > 0.5, "towards the scanner: {normal}");
        }
        assert_normal(name, &directions);
        assert_normal(name, &places);
    }
}

#[test]
fn the_generatrix_lies_on_the_surface() {
    for z_mm in [extruded, dish, baluster, mould] {
        let fit = swept(&seen(3000, 12.0, 7, z_mm), 1.0).unwrap();
        let [across, up] = fit.swept.sweep.across();
        let towards = 0.6 * across + 0.8 * up;
        let curve = fit.swept.generatrix(&towards);
        curve.validate().unwrap();
        for place in curve.sampled(20) {
            let off_mm = fit.swept.distance_mm(&place.into());
            assert!(off_mm.abs() < 1e-9, "{place:?}: {off_mm}");
        }
    }
}

#[test]
fn more_samples_make_the_profile_longer() {
    let (few, all) = (seen(3000, 10.0, 5, extruded), seen(8000, 20.0, 5, extruded));
    let short = swept(&few, 1.0).unwrap();
    let long = short.again(&all, 1.0).unwrap();
    let length = |fit: &SweptFit| fit.swept.profile.domain().1 - fit.swept.profile.domain().0;
    assert!(length(&long) > 1.7 * length(&short));
    assert!(long.span_mm <= short.span_mm);
    assert!(long.direction_rad.most() < 0.5 * short.direction_rad.most());
    let [x, y] = [-18.0, 17.0];
    let z = long.swept.z_mm(x, y, 0.0).unwrap();
    assert!((z - extruded(x, y)).abs() < 0.03, "{z}");
}

#[test]
fn free_forms_are_none() {
    let sheets: [fn(f64, f64) -> f64; 5] = [
        |x, y| 2.0 * libm::sin(x / 9.0) * libm::cos(y / 11.0),
        |x, y| (x * x - y * y) / 200.0 + x * x * x / 20_000.0,
        // Of one profile at either side, but not of the same.
        |x, y| wave(x) * (1.0 + 0.01 * y),
        // Swept along an arc, but not about its axis.
        |x, y| wave(x) - y * y / 80.0,
        // Two profiles crosswise.
        |x, y| wave(x) + wave(1.3 * y),
    ];
    for (number, z_mm) in sheets.into_iter().enumerate() {
        for seed in 0..6 {
            let found = swept(&seen(4000, 20.0, seed, z_mm), 1.0);
            let found = found.map(|fit| (fit.swept.as_str(), fit.rms_mm));
            assert_eq!(found, None, "sheet {number}, {seed}");
        }
    }
}

#[test]
fn too_few_samples_tell_nothing() {
    assert!(swept(&seen(300, 20.0, 1, extruded), 1.0).is_none());
    assert!(swept(&seen(3000, 20.0, 1, extruded), 10.0).is_none());
    assert!(swept(&[], 1.0).is_none());
    let line: Vec<Sample> = seen(3000, 20.0, 1, extruded)
        .into_iter()
        .map(|mut sample| {
            sample.point_mm.y = 0.0;
            sample
        })
        .collect();
    assert!(swept(&line, 1.0).is_none());
}
