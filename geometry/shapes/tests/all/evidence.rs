//! Which kind of surface is found where it is known.

use crate::known;

use nalgebra::Vector3;
use shapes::{Evidence, Family, Sample, Shape, Torus, Verdict, decide, decide_whole};

use known::{NOISE_MM, Random, cases, samples};

fn family(evidence: &Evidence) -> Option<Family> {
    match &evidence.verdict {
        Verdict::Shape(fit) => Some(fit.shape.family()),
        Verdict::Swept(_) | Verdict::FreeForm | Verdict::Unknown => None,
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

/// The fillet around a boss or a hole, seen from above along a tilted axis: evenly in x and y, noise
/// along the normal.
fn fillet(
    (radius_mm, tube_mm): (f64, f64),
    (is_hollow, share, from): (bool, f64, f64),
    seed: u64,
) -> Vec<Sample> {
    const PITCH_MM: f64 = 0.4;
    let axis = Vector3::new(0.08, -0.1, 1.0).normalize();
    let shape = Torus {
        centre_mm: Vector3::new(20.0, -10.0, 5.0),
        axis,
        radius_mm,
        tube_mm,
        is_hollow,
    };
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(3));
    let reach = ((radius_mm + tube_mm) / PITCH_MM) as i32;
    let at = |k: i32, middle: f64| middle + PITCH_MM * f64::from(k);
    let places = (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| (i, j)));
    let aside = axis.cross(&Vector3::y()).normalize();
    let ahead = aside.cross(&axis);
    places
        .filter_map(|(i, j)| {
            let (u, v) = (at(i, 0.13), at(j, 0.31));
            let out = (u * u + v * v).sqrt();
            // To where a face that it touches has turned by 70 degrees; of a hollow one the inner
            // half is seen, of the other the outer half.
            let beyond = if is_hollow {
                radius_mm - out
            } else {
                out - radius_mm
            };
            let is_on = (from * tube_mm..0.94 * tube_mm).contains(&beyond);
            if !is_on || libm::atan2(v, u).abs() > share * core::f64::consts::PI {
                return None;
            }
            let up = (tube_mm * tube_mm - beyond * beyond).sqrt();
            let up = if is_hollow { -up } else { up };
            let point = shape.centre_mm + aside * u + ahead * v + axis * up;
            let from_tube = aside * (u - u / out * radius_mm) + ahead * (v - v / out * radius_mm);
            let normal = (from_tube + axis * up).normalize();
            Some(Sample {
                point_mm: point + normal * (NOISE_MM * random.normal()),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM / normal.z.abs(),
            })
        })
        .collect()
}

#[test]
fn a_fillet_around_a_boss_is_a_torus() {
    let mut wrong = Vec::new();
    for sizes in [
        (11.6, 2.6),
        (12.2, 2.8),
        (13.7, 4.0),
        (8.0, 3.0),
        (14.8, 4.3),
    ] {
        for is_hollow in [false, true] {
            for (share, from) in [(1.0, 0.0), (1.0, 0.3), (0.6, 0.0), (0.6, 0.3), (0.4, 0.3)] {
                for seed in 0..3 {
                    let samples = fillet(sizes, (is_hollow, share, from), seed);
                    let evidence = decide(&samples, 1.0);
                    let found = evidence.fit().map(|fit| fit.shape);
                    // Hollow or not tells which side was seen.
                    let is_right =
                        matches!(found, Some(Shape::Torus(t)) if t.is_hollow == is_hollow);
                    if !is_right {
                        let which = (sizes, is_hollow, share, from, seed);
                        wrong.push(format!("{which:?}: {:?}", evidence.candidates));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} {wrong:#?}", wrong.len());
}

/// Samples of a slender cone that is seen from above, its axis along x and its radius that of a shaft,
/// as far as this to either side, in radians around the axis and in millimetres along it.
fn tapered((reach, half_mm): (f64, f64), half_angle_rad: f64, seed: u64) -> Vec<Sample> {
    const RADIUS_MM: f64 = 23.5;
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(11));
    let (sin, cos) = libm::sincos(half_angle_rad);
    (0..2500)
        .map(|_| {
            let x = half_mm * (2.0 * random.uniform() - 1.0);
            let (across, up) = libm::sincos(reach * (2.0 * random.uniform() - 1.0));
            let radius_mm = RADIUS_MM + x * sin / cos;
            let normal = Vector3::new(-sin, across * cos, up * cos);
            let point = Vector3::new(x, across * radius_mm, up * radius_mm);
            Sample {
                point_mm: point + normal * (NOISE_MM * random.normal()),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM / normal.z,
            }
        })
        .collect()
}

/// A cylinder that leans lies about as near to its samples as polynomials do, and the cone nearer.
#[test]
fn a_slender_cone_is_no_cylinder_that_leans() {
    for seen in [(1.0, 3.0), (1.0, 4.5), (1.1, 6.0)] {
        for seed in 0..6 {
            let evidence = decide(&tapered(seen, 0.015, seed), 1.0);
            assert_eq!(
                family(&evidence),
                Some(Family::Cone),
                "{seen:?} {seed}: {:?}",
                evidence.candidates
            );
            let straight = decide(&tapered(seen, 0.0, seed), 1.0);
            assert_eq!(family(&straight), Some(Family::Cylinder), "{seen:?} {seed}");
        }
    }
}

/// Of rings of which the steep flank alone is seen, some are not found without a longer search.
#[test]
fn a_flank_that_is_all_of_a_torus_is_one() {
    for (sizes, share, from) in [
        ((6.0, 3.0), 1.0, 0.55),
        ((6.0, 3.0), 0.5, 0.5),
        ((2.0, 7.0), 1.0, 0.55),
    ] {
        for seed in 0..6 {
            let evidence = decide_whole(&fillet(sizes, (false, share, from), seed), 1.0);
            let which = (sizes, share, from, seed);
            assert_eq!(
                family(&evidence),
                Some(Family::Torus),
                "{which:?}: {:?}",
                evidence.candidates
            );
        }
    }
}
