//! Which kind of surface is found where it is known.

mod known;

use nalgebra::Vector3;
use shapes::{Evidence, Family, Sample, Verdict, decide};

use known::{NOISE_MM, Random, cases, samples};

fn family(evidence: &Evidence) -> Option<Family> {
    match &evidence.verdict {
        Verdict::Shape(fit) => Some(fit.shape.family()),
        Verdict::FreeForm | Verdict::Unknown => None,
    }
}

/// Samples of z over a square with sides of 40 mm.
fn sheet(count: usize, seed: u64, z_mm: impl Fn(f64, f64) -> f64) -> Vec<Sample> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(7));
    (0..count)
        .map(|_| {
            let (x, y) = (
                40.0 * random.uniform() - 20.0,
                40.0 * random.uniform() - 20.0,
            );
            Sample {
                point_mm: Vector3::new(x, y, z_mm(x, y) + NOISE_MM * random.normal()),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM,
            }
        })
        .collect()
}

#[test]
fn each_family_is_told_from_the_others() {
    for case in cases() {
        for seed in 0..12 {
            let evidence = decide(&samples(&case, 1000, seed + 500), 1.0);
            let expected = Some(case.0.family());
            assert_eq!(
                family(&evidence),
                expected,
                "{seed}: {:?}",
                evidence.candidates
            );
        }
    }
}

#[test]
fn what_is_of_no_family_is_free_form() {
    let sheets: [fn(f64, f64) -> f64; 4] = [
        |x, y| 2.0 * libm::sin(x / 9.0) * libm::cos(y / 11.0),
        // A paraboloid bends less off its middle than a sphere does.
        |x, y| -(x * x + y * y) / 60.0,
        // So shallow that nowhere it is off a plane by more than the noise. (A single saddle of
        // half this height would be off a torus by less than a tenth of the noise.)
        |x, y| 0.05 * libm::sin(x / 6.0) * libm::sin(y / 6.0),
        // A saddle.
        |x, y| (x * x - y * y) / 200.0 + x * x * x / 20_000.0,
    ];
    for (number, z_mm) in sheets.into_iter().enumerate() {
        for seed in 0..4 {
            let evidence = decide(&sheet(4000, seed, z_mm), 1.0);
            assert!(
                matches!(evidence.verdict, Verdict::FreeForm),
                "sheet {number}, {seed}: {:?}",
                evidence.candidates
            );
        }
    }
}

#[test]
fn noise_makes_no_bends() {
    for seed in 0..40 {
        let count = [60, 200, 1000, 3000][seed as usize % 4];
        let evidence = decide(&sheet(count, seed + 50, |x, y| 0.3 * x - 0.1 * y), 1.0);
        assert_eq!(
            family(&evidence),
            Some(Family::Plane),
            "{:?}",
            evidence.candidates
        );
    }
}

#[test]
fn a_plane_is_told_by_fewer_samples_than_a_polynomial() {
    for seed in 0..20 {
        let evidence = decide(&sheet(10, seed, |x, y| 0.3 * x - 0.1 * y), 1.0);
        assert_eq!(family(&evidence), Some(Family::Plane), "{seed}");
        let all = &evidence.candidates;
        assert!(all.iter().all(|candidate| candidate.family.is_some()));
    }
}

#[test]
fn where_no_family_comes_near_none_is_fitted() {
    let bumps = |x: f64, y: f64| 3.0 * libm::sin(x / 12.0) * libm::sin(y / 12.0);
    let evidence = decide(&sheet(4000, 3, bumps), 1.0);
    assert!(matches!(evidence.verdict, Verdict::FreeForm));
    let all = &evidence.candidates;
    assert!(!all.is_empty() && all.iter().all(|candidate| candidate.family.is_none()));
}

#[test]
fn too_few_samples_tell_nothing() {
    let few = sheet(6, 1, |_, _| 0.0);
    assert!(matches!(decide(&few, 1.0).verdict, Verdict::Unknown));
    assert!(matches!(decide(&[], 1.0).verdict, Verdict::Unknown));
    // Alike in so many, 100 samples say as much as 6.
    let alike = sheet(100, 1, |_, _| 0.0);
    assert!(matches!(decide(&alike, 17.0).verdict, Verdict::Unknown));
}

/// A lying shaft as a scanner sees it: evenly in x and y, noise along z, more of it on slopes.
fn lying(radius_mm: f64, length_mm: f64, steepest_rad: f64, seed: u64) -> Vec<Sample> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(3));
    let half = radius_mm * libm::sin(steepest_rad);
    let tilt_rad = 0.3 * random.uniform() - 0.15;
    let count = (length_mm * 2.0 * half * 4.0) as usize;
    (0..count)
        .map(|_| {
            let x = length_mm * random.uniform();
            let y = half * (2.0 * random.uniform() - 1.0);
            let up = (radius_mm * radius_mm - y * y).sqrt();
            let z = (up + x * libm::sin(tilt_rad)) / libm::cos(tilt_rad);
            let sigma_mm = NOISE_MM * radius_mm / (up * libm::cos(tilt_rad));
            Sample {
                point_mm: Vector3::new(x, y, z + sigma_mm * random.normal()),
                ray: Vector3::z(),
                sigma_mm,
            }
        })
        .collect()
}

#[test]
fn a_short_shaft_seen_half_around_is_a_cylinder() {
    let mut wrong = Vec::new();
    for (radius_mm, length_mm) in [(20.0, 8.0), (28.0, 12.0), (29.7, 16.0), (40.0, 10.0)] {
        for steepest_rad in [0.7, 1.0, 1.15, 1.25] {
            for seed in 0..4 {
                let samples = lying(radius_mm, length_mm, steepest_rad, seed);
                let evidence = decide(&samples, 1.0);
                if family(&evidence) != Some(Family::Cylinder) {
                    wrong.push((
                        radius_mm,
                        length_mm,
                        steepest_rad,
                        seed,
                        evidence.candidates,
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} {wrong:#?}", wrong.len());
}
