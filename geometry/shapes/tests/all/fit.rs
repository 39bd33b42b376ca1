//! Fits to samples of known shapes, with noise: right, and as sure as they say.

use crate::known;

use nalgebra::Vector3;
use shapes::{Family, Fit, Measured, Sample, Shape, fit};

use known::{Case, NOISE_MM, Random, cases, samples};

fn fitted(case: &Case, count: usize, seed: u64) -> Fit {
    let family = case.0.family();
    fit(family, &samples(case, count, seed), 1.0).expect("enough samples of this family")
}

#[test]
fn every_family_is_found_again() {
    for case in cases() {
        let found = fitted(&case, 2000, 1);
        assert!((found.rms_mm / NOISE_MM - 1.0).abs() < 0.05, "{found:?}");
        assert!(found.held > 1990, "{}", found.held);
        // Everywhere on the surface, not only at samples.
        for k in 0..100 {
            let place = (case.1)(&case.0, f64::from(k % 10) / 9.0, f64::from(k / 10) / 9.0);
            let off = found.shape.distance_mm(&place).abs();
            assert!(off < 0.3 * NOISE_MM, "{}: {off}", case.0.family());
        }
    }
}

#[test]
fn a_tenth_of_strays_changes_nothing() {
    for case in cases() {
        let mut with = samples(&case, 1000, 3);
        let clean = fit(case.0.family(), &with, 1.0).expect("as above");
        let mut random = Random(9);
        for sample in with.iter_mut().step_by(10) {
            sample.point_mm.z += 20.0 * (random.uniform() - 0.3);
        }
        let found = fit(case.0.family(), &with, 1.0).expect("most are there");
        assert!(found.held < 940, "{}", found.held);
        for k in 0..100 {
            let place = (case.1)(&case.0, f64::from(k % 10) / 9.0, f64::from(k / 10) / 9.0);
            let apart = found.shape.distance_mm(&place) - clean.shape.distance_mm(&place);
            assert!(apart.abs() < NOISE_MM, "{}: {apart}", case.0.family());
        }
    }
}

/// The error of a number over its stated deviation.
fn pull(found: Option<Measured>, truth: f64) -> f64 {
    let found = found.expect("a number of this family");
    (found.value - truth) / found.deviation
}

#[test]
fn numbers_are_as_sure_as_they_say() {
    const SEEDS: u64 = 120;
    for case in cases() {
        let mut pulls: Vec<(&str, Vec<f64>)> = Vec::new();
        let mut note = |name: &'static str, pull: f64| match pulls.iter_mut().find(|p| p.0 == name)
        {
            Some((_, all)) => all.push(pull),
            None => pulls.push((name, vec![pull])),
        };
        for seed in 0..SEEDS {
            let found = fitted(&case, 400, seed + 100);
            let n = &found.numbers;
            match (&case.0, &found.shape) {
                (Shape::Plane(true_plane), Shape::Plane(plane)) => {
                    let tilt = (plane.normal - true_plane.normal).dot(&Vector3::x());
                    let direction = n.direction_rad.expect("a plane has one");
                    note("tilt", tilt / direction.along(&Vector3::x()));
                    assert!(direction.most() >= direction.along(&Vector3::y()));
                    let off = true_plane
                        .normal
                        .dot(&(plane.point_mm - true_plane.point_mm));
                    note("offset", off / n.place_mm.along(&true_plane.normal));
                }
                (Shape::Sphere(sphere), _) => note("radius", pull(n.radius_mm, sphere.radius_mm)),
                (Shape::Cylinder(cylinder), _) => {
                    note("radius", pull(n.radius_mm, cylinder.radius_mm));
                }
                (Shape::Cone(cone), _) => {
                    note("angle", pull(n.half_angle_rad, cone.half_angle_rad));
                }
                (Shape::Torus(torus), _) => {
                    note("radius", pull(n.radius_mm, torus.radius_mm));
                    note("tube", pull(n.tube_mm, torus.tube_mm));
                }
                _ => panic!("another family"),
            }
        }
        for (name, pulls) in &pulls {
            let family = case.0.family();
            let mean = pulls.iter().sum::<f64>() / SEEDS as f64;
            let square = pulls.iter().map(|p| p * p).sum::<f64>() / SEEDS as f64;
            let within = pulls.iter().filter(|p| p.abs() <= 1.96).count();
            // Of 120: 95 % is 114; five standard deviations of that are 12.
            assert!(
                within >= 102,
                "{family} {name}: {within} of {SEEDS} within 95 %"
            );
            assert!((0.6..1.5).contains(&square), "{family} {name}: {square}");
            assert!(mean.abs() < 0.45, "{family} {name}: {mean}");
        }
    }
}

#[test]
fn noise_along_rays_does_not_tilt_a_slope() {
    // A strip 4 mm wide, 66 degrees steep: noise along z moves its samples down the slope too.
    const RISE: f64 = 2.25;
    let normal = Vector3::new(-RISE, 0.0, 1.0).normalize();
    let mut pulls = Vec::new();
    for seed in 0..60 {
        let mut random = Random(seed * 77 + 5);
        let strip: Vec<Sample> = (0..400)
            .map(|_| {
                let (x, y) = (1.6 * random.uniform(), 60.0 * random.uniform());
                Sample {
                    point_mm: Vector3::new(x, y, RISE * x + 0.15 * random.normal()),
                    ray: Vector3::z(),
                    sigma_mm: 0.15,
                }
            })
            .collect();
        let found = fit(Family::Plane, &strip, 1.0).expect("enough samples");
        let Shape::Plane(plane) = found.shape else {
            panic!("another family");
        };
        let way = normal.cross(&Vector3::y());
        let direction = found.numbers.direction_rad.expect("a plane has one");
        pulls.push(plane.normal.dot(&way) / direction.along(&way));
    }
    let mean = pulls.iter().sum::<f64>() / pulls.len() as f64;
    let square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64;
    assert!(mean.abs() < 0.5 && square < 1.6, "{mean} {square}");
}

#[test]
fn what_turns_away_is_as_wide_as_it_is() {
    // A rod seen from above to 75 degrees on either side, where noise along z is four times as
    // great as on top: it moves samples by so much that the slope is another there.
    const RADIUS_MM: f64 = 3.0;
    let mut pulls = Vec::new();
    for seed in 0..60 {
        let mut random = Random(seed * 91 + 3);
        let rod: Vec<Sample> = (0..3000)
            .map(|_| {
                let angle = (150.0 * random.uniform() - 75.0_f64).to_radians();
                let (sin, cos) = libm::sincos(angle);
                let sigma_mm = NOISE_MM / cos;
                let z = RADIUS_MM * cos + sigma_mm * random.normal();
                Sample {
                    point_mm: Vector3::new(RADIUS_MM * sin, 40.0 * random.uniform(), z),
                    ray: Vector3::z(),
                    sigma_mm,
                }
            })
            .collect();
        let found = fit(Family::Cylinder, &rod, 1.0).expect("enough samples");
        pulls.push(pull(found.numbers.radius_mm, RADIUS_MM));
    }
    let mean = pulls.iter().sum::<f64>() / pulls.len() as f64;
    let square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64;
    // By the slope at the samples it would be 4 deviations too narrow; 1.3 are left, which are not
    // yet understood.
    assert!(mean.abs() < 2.0 && square < 5.0, "{mean} {square}");
}

#[test]
fn what_is_too_flat_or_too_little_is_of_no_such_family() {
    let plane = &cases()[0];
    let few = samples(plane, 3, 1);
    assert!(fit(Family::Plane, &few, 1.0).is_none());
    assert!(fit(Family::Plane, &[], 1.0).is_none());
    let line: Vec<Sample> = (0..50)
        .map(|k| Sample {
            point_mm: Vector3::new(f64::from(k), 2.0, 3.0),
            ray: Vector3::z(),
            sigma_mm: NOISE_MM,
        })
        .collect();
    for family in Family::ALL {
        assert!(fit(family, &line, 1.0).is_none(), "{family}");
    }
    let exact: Vec<Sample> = samples(plane, 500, 2)
        .iter()
        .map(|s| Sample {
            point_mm: Vector3::new(s.point_mm.x, s.point_mm.y, 1.0),
            ..*s
        })
        .collect();
    assert!(fit(Family::Plane, &exact, 1.0).is_some());
    assert!(fit(Family::Cylinder, &exact, 1.0).is_none());
}

/// What is told of the numbers one by one is in their joint covariance, and what they have in
/// common: a ball's top is known far better than its centre and its radius are.
#[test]
fn numbers_have_in_common_what_their_errors_have() {
    const SEEDS: u64 = 120;
    for case in cases() {
        let mut pulls = Vec::new();
        for seed in 0..SEEDS {
            let found = fitted(&case, 400, seed + 700);
            let (joint, n) = (found.joint(), &found.numbers);
            assert!((joint - joint.transpose()).norm() <= 1e-12 * joint.norm());
            if let Some(direction) = n.direction_rad {
                let apart = joint.fixed_view::<3, 3>(0, 0) - direction.covariance;
                assert!(apart.norm() <= 1e-9 * direction.covariance.norm());
            }
            let sizes = [n.radius_mm, n.tube_mm, n.half_angle_rad];
            for (k, size) in sizes.into_iter().enumerate() {
                let deviation = size.map_or(0.0, |size| size.deviation);
                assert!(
                    (joint[(6 + k, 6 + k)].sqrt() - deviation).abs() <= 1e-9 * (1.0 + deviation)
                );
            }
            let (Shape::Sphere(real), Shape::Sphere(ball)) = (&case.0, &found.shape) else {
                continue;
            };
            let sense = if ball.is_hollow { -1.0 } else { 1.0 };
            let top = |centre: Vector3<f64>, radius: f64| centre.z + sense * radius;
            let off = top(ball.centre_mm, ball.radius_mm) - top(real.centre_mm, real.radius_mm);
            let variance = joint[(5, 5)] + joint[(6, 6)] + 2.0 * sense * joint[(5, 6)];
            assert!(
                variance < 0.2 * joint[(5, 5)],
                "{variance} {}",
                joint[(5, 5)]
            );
            pulls.push(off / variance.sqrt());
        }
        if !pulls.is_empty() {
            let squares = pulls.iter().map(|pull| pull * pull).sum::<f64>();
            let rms = (squares / pulls.len() as f64).sqrt();
            assert!((0.8..1.2).contains(&rms), "{rms}");
        }
    }
}
