//! Where the answer is known in closed form, and at the edges of what can be asked.

#![allow(missing_docs, dead_code)]

use crate::common;

use common::{
    Chance, Known, SIZE_MM, WELL, after, cone, cylinder, direction, fitted, found, plane, sphere,
    torus,
};
use nalgebra::{Matrix2, Vector2, Vector3};
use regularize::{Fitted, Kind, Reason, Round, Settings, Target, regularize};
use shapes::Shape;

/// A plane whose normal is nearly z, leaning by so much along x and y, with this covariance.
fn leaning(label: u16, lean: Vector2<f64>, covariance: &Matrix2<f64>, x_mm: f64) -> Fitted {
    let normal = Vector3::new(lean.x, lean.y, 1.0);
    let mut own = fitted(label, plane(normal, Vector3::new(x_mm, 0.0, 0.0)), WELL);
    own.joint.fixed_view_mut::<3, 3>(0, 0).fill(0.0);
    own.joint.fixed_view_mut::<2, 2>(0, 0).copy_from(covariance);
    own
}

#[test]
fn two_planes_end_at_their_weighted_mean() {
    let first = Matrix2::new(4e-8, 1e-8, 1e-8, 1e-8);
    let second = Matrix2::new(1e-8, -0.5e-8, -0.5e-8, 9e-8);
    let (a, b) = (Vector2::new(1.5e-4, 0.0), Vector2::new(0.0, 2.0e-4));
    let mut shapes = [leaning(1, a, &first, 0.0), leaning(2, b, &second, 30.0)];
    // So far apart that they are not one plane, and not by a round number.
    if let Shape::Plane(plane) = &mut shapes[1].shape {
        plane.point_mm.z = 7.3456;
    }
    let found = found(&shapes);
    let kinds: Vec<_> = found.accepted.iter().map(|own| own.kind).collect();
    assert_eq!(kinds, [Kind::Parallel]);
    let [v, w] = [first, second].map(|own| own.try_inverse().unwrap());
    let covariance = (v + w).try_inverse().unwrap();
    let mean = covariance * (v * a + w * b);
    for adjusted in &found.adjusted {
        let normal = direction(&adjusted.shape);
        let lean = Vector2::new(normal.x / normal.z, normal.y / normal.z);
        assert!((lean - mean).norm() < 1e-10, "{lean} {mean}");
        let told = adjusted.numbers.direction_rad.unwrap().covariance;
        let off = told.fixed_view::<2, 2>(0, 0) - covariance;
        assert!(off.norm() < 1e-3 * covariance.norm(), "{told} {covariance}");
    }
    // Chi-square of two numbers that are to be the same.
    let apart = a - b;
    let squares = apart.dot(&((first + second).try_inverse().unwrap() * apart));
    let told = found.accepted[0].deviations;
    assert!((told * told - squares).abs() < 1e-3 * squares);
    assert!((found.accepted[0].p - libm::exp(-0.5 * squares)).abs() < 1e-3);
    let off = found.accepted[0].off_rad.unwrap();
    assert!((off - apart.norm()).abs() < 1e-8, "{off}");
}

#[test]
fn equal_radii_are_the_weighted_mean_and_surer() {
    let known = |size| Known { size, ..WELL };
    let at = |x| Vector3::new(x, 0.0, 0.0);
    let shapes = [
        fitted(4, sphere(at(0.0), 8.0371), known(0.003)),
        fitted(9, sphere(at(20.3), 8.0431), known(0.006)),
    ];
    let found = found(&shapes);
    let equal = &found.accepted[0];
    assert_eq!(
        (equal.kind, &equal.labels[..]),
        (Kind::EqualRadii, &[4, 9][..])
    );
    for adjusted in &found.adjusted {
        let radius = adjusted.numbers.radius_mm.unwrap();
        assert!((radius.value - 8.0383).abs() < 1e-9, "{radius:?}");
        let deviation = 1.0 / (1.0 / 9e-6 + 1.0 / 36e-6_f64).sqrt();
        assert!((radius.deviation - deviation).abs() < 1e-9);
    }
}

/// Covariances between direction and place of one shape carry an adjustment of the one over.
#[test]
fn what_is_correlated_moves_along() {
    let mut shapes = [
        fitted(
            1,
            plane(Vector3::new(1e-3, 0.0, 1.0), Vector3::zeros()),
            WELL,
        ),
        fitted(2, plane(Vector3::z(), Vector3::new(0.0, 0.0, 3.377)), WELL),
    ];
    shapes[0].joint[(0, 5)] = 0.5 * WELL.turn_rad * WELL.place_mm;
    shapes[0].joint[(5, 0)] = shapes[0].joint[(0, 5)];
    let found = found(&shapes);
    assert_eq!(found.accepted[0].kind, Kind::Parallel);
    let Shape::Plane(first) = found.adjusted[0].shape else {
        panic!("{:?}", found.adjusted[0].shape);
    };
    // Turned by 0.5 mrad, a standard deviation: half a one of its place.
    assert!(
        (first.point_mm.z + 0.5 * WELL.place_mm).abs() < 1e-5,
        "{first:?}"
    );
}

#[test]
fn the_likelier_of_contradictory_ones_hold() {
    // The middle one is near both of the others, which are not near each other.
    let radii = [7.4332, 7.4332 + 2.6 * 0.003, 7.4332 + 6.0 * 0.003];
    let shapes: Vec<_> = radii
        .into_iter()
        .enumerate()
        .map(|(k, radius)| {
            let centre = Vector3::new(17.3 * k as f64, 3.0, 0.0);
            fitted(k as u16 + 1, sphere(centre, radius), WELL)
        })
        .collect();
    let found = found(&shapes);
    let equal: Vec<_> = found.accepted.iter().collect();
    assert_eq!(equal.len(), 1, "{equal:?}");
    assert_eq!(equal[0].labels, [1, 2]);
    let refused = |labels: [u16; 2]| {
        let own = found.refused.iter().find(|own| own.labels == labels);
        own.map(|own| (own.kind, own.reason))
    };
    assert_eq!(
        refused([2, 3]),
        Some((Kind::EqualRadii, Reason::Contradicted))
    );
    assert_eq!(refused([1, 3]), Some((Kind::EqualRadii, Reason::TooFar)));
    let radii: Vec<f64> = after(&shapes, &found)
        .iter()
        .map(|shape| match shape {
            Shape::Sphere(sphere) => sphere.radius_mm,
            _ => f64::NAN,
        })
        .collect();
    assert!((radii[0] - radii[1]).abs() < 1e-9 && radii[2] == shapes_radius(&shapes[2]));
}

fn shapes_radius(own: &Fitted) -> f64 {
    match own.shape {
        Shape::Sphere(sphere) => sphere.radius_mm,
        _ => f64::NAN,
    }
}

#[test]
fn a_round_number_is_on_the_coarsest_grid_that_explains_it() {
    let round = |radius: f64, size: f64, settings: &Settings| {
        let shapes = [fitted(
            1,
            sphere(Vector3::zeros(), radius),
            Known { size, ..WELL },
        )];
        let found = regularize(&shapes, &[], SIZE_MM, settings).unwrap();
        found.accepted.first().map(|own| (own.kind, own.target))
    };
    let mm = |value| Some((Kind::RoundRadius, Some(Target::Millimetres(value))));
    let settings = Settings::default();
    assert_eq!(round(7.9991, 0.002, &settings), mm(8.0));
    assert_eq!(round(7.5004, 0.001, &settings), mm(7.5));
    assert_eq!(round(7.3001, 0.0001, &settings), mm(7.3));
    // As uncertain as that, every number is near one.
    assert_eq!(round(7.9991, 0.05, &settings), None);
    assert_eq!(round(7.3001, 0.003, &settings), None);
    // Off by five standard uncertainties.
    assert_eq!(round(8.0005, 0.0001, &settings), None);
    let inch = Settings {
        round: Round::Inch,
        ..settings
    };
    assert_eq!(
        round(25.4 * 5.0 / 16.0, 0.0005, &inch),
        mm(25.4 * 5.0 / 16.0)
    );
    assert_eq!(round(25.4 * 5.0 / 16.0, 0.0005, &settings), None);
}

#[test]
fn angles_and_the_frame_count_only_if_asked_for() {
    let lean = Vector3::new(libm::sin(0.523_7), 0.0, libm::cos(0.523_7));
    let shapes = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(2, plane(lean, Vector3::new(31.3, 4.0, 5.0)), WELL),
    ];
    let of = |settings: &Settings| {
        let found = regularize(&shapes, &[], SIZE_MM, settings).unwrap();
        let mut kinds: Vec<_> = found.accepted.iter().map(|own| own.kind).collect();
        kinds.sort_by_key(|kind| kind.as_str());
        kinds
    };
    let settings = Settings::default();
    assert_eq!(of(&settings), []);
    let angles = Settings {
        angles: true,
        ..settings
    };
    assert_eq!(of(&angles), [Kind::Angle]);
    let found_angle = regularize(&shapes, &[], SIZE_MM, &angles).unwrap();
    let normals: Vec<_> = found_angle
        .adjusted
        .iter()
        .map(|own| direction(&own.shape))
        .collect();
    let off = normals[0].dot(&normals[1]) - libm::cos(30.0_f64.to_radians());
    assert!(off.abs() < 1e-9, "{off}");
    let frame = Settings {
        frame: true,
        ..settings
    };
    // Both lie along y; the first is square to z.
    assert_eq!(of(&frame), [Kind::AlongFrame(1), Kind::AcrossFrame(2)]);
}

#[test]
fn nothing_is_moved_beyond_the_limits() {
    let loose = Known {
        turn_rad: 0.02,
        place_mm: 0.004,
        size: 0.003,
    };
    let shapes = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(
            2,
            plane(Vector3::new(0.05, 0.0, 1.0), Vector3::new(31.0, 0.0, 5.37)),
            loose,
        ),
    ];
    let settings = Settings {
        most_rad: 0.06,
        ..Settings::default()
    };
    let far = regularize(&shapes, &[], SIZE_MM, &settings).unwrap();
    assert_eq!(far.accepted[0].kind, Kind::Parallel);
    assert!(far.adjusted[1].turned_rad > 0.04);
    // 2 degrees by default.
    let near = found(&shapes);
    assert_eq!(near.accepted, []);
    assert_eq!(near.refused[0].reason, Reason::Limit);
}

#[test]
fn two_one_and_no_shapes_are_enough() {
    assert_eq!(found(&[]), Default::default());
    let one = [fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL)];
    assert_eq!(found(&one), Default::default());
    let two = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(
            2,
            cylinder(Vector3::new(2e-4, 0.0, 1.0), Vector3::zeros(), 11.237),
            WELL,
        ),
    ];
    let found = found(&two);
    assert_eq!(found.accepted.len(), 1, "{:?}", found.accepted);
    assert_eq!(found.accepted[0].kind, Kind::Perpendicular);
    assert_eq!(found.adjusted.len(), 2);
}

#[test]
fn what_is_no_number_is_tied_to_nothing() {
    let mut shapes = vec![
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(2, plane(Vector3::z(), Vector3::new(1.0, 1.0, 4.337)), WELL),
        fitted(
            3,
            plane(Vector3::z(), Vector3::new(f64::NAN, 1.0, 4.0)),
            WELL,
        ),
        fitted(4, plane(Vector3::z(), Vector3::new(9.0, 1.0, 9.731)), WELL),
    ];
    shapes[3].joint[(0, 0)] = f64::INFINITY;
    let none = Known {
        turn_rad: 0.0,
        place_mm: 0.0,
        size: 0.0,
    };
    shapes.push(fitted(5, sphere(Vector3::zeros(), 8.0), none));
    let found_ = found(&shapes);
    assert!(found_.accepted.iter().all(|own| own.labels == [1, 2]));
    assert_eq!(found_.accepted.len(), 1);
    for size_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let none = regularize(&shapes, &[], size_mm, &Settings::default()).unwrap();
        assert_eq!(none, Default::default());
    }
    let wrong = Settings {
        bound: 0.1,
        ..Settings::default()
    };
    assert!(regularize(&shapes, &[], SIZE_MM, &wrong).is_err());
}

/// A part of many ties, turned anyhow.
fn part(seed: u64) -> Vec<Fitted> {
    let mut chance = Chance::new(seed);
    let z = chance.direction();
    let x = z.cross(&chance.direction()).normalize();
    let y = z.cross(&x);
    let at = |a: f64, b: f64, c: f64| x * a + y * b + z * c;
    let shapes = [
        plane(z, at(1.0, 2.0, 0.0)),
        plane(z, at(20.0, -12.0, 15.0)),
        plane(x, at(30.0, 1.0, 3.0)),
        plane(y, at(3.0, 30.0, 8.0)),
        cylinder(z, at(10.0, 10.0, -4.0), 8.0),
        cylinder(-z, at(10.0, 10.0, 12.0), 8.0),
        cylinder(z, at(-17.0, 10.0, 2.0), 5.5),
        sphere(at(10.0, 10.0, 25.0), 12.0),
        cone(z, at(-17.0, 10.0, 20.0), 45.0),
        torus(z, at(-17.0, 10.0, 6.0), 14.357, 5.5),
    ];
    let each = shapes.iter().zip(1..);
    each.map(|(shape, label)| chance.measured(label, shape, WELL))
        .collect()
}

#[test]
fn the_order_of_the_shapes_does_not_matter() {
    for seed in 1..=10 {
        let shapes = part(seed);
        let there = found(&shapes);
        let mut turned = shapes.clone();
        turned.reverse();
        turned.swap(1, 5);
        let back = found(&turned);
        let (one, other) = (after(&shapes, &there), after(&turned, &back));
        for (own, shape) in shapes.iter().zip(&one) {
            let place = turned.iter().position(|t| t.label == own.label).unwrap();
            let off = (direction(shape) - direction(&other[place])).norm();
            assert!(off < 1e-8, "seed {seed}, {}: {off}", own.label);
            let probe = Vector3::new(3.0, -1.0, 40.0);
            let apart = shape.distance_mm(&probe) - other[place].distance_mm(&probe);
            assert!(apart.abs() < 1e-6, "seed {seed}, {}: {apart}", own.label);
        }
        assert_eq!(there.accepted.len(), back.accepted.len(), "seed {seed}");
        let again = found(&shapes);
        assert_eq!(again, there, "the same bytes");
    }
}

#[test]
fn a_ring_about_a_bore_is_coaxial_and_its_tube_as_wide() {
    let mut found_all = 0;
    for seed in 1..=20 {
        let found = found(&part(seed));
        let has = |kind: Kind, labels: &[u16]| {
            let mut all = found.accepted.iter().filter(|own| own.kind == kind);
            all.any(|own| labels.iter().any(|label| own.labels.contains(label)))
        };
        found_all += usize::from(has(Kind::Coaxial, &[10]) && has(Kind::EqualRadii, &[10]));
    }
    assert!(found_all >= 18, "{found_all}");
}

#[test]
fn parts_of_all_sizes_are_treated_alike() {
    let shapes = part(3);
    let count = |factor: f64| {
        let scaled: Vec<Fitted> = shapes
            .iter()
            .map(|own| {
                let mut own = own.clone();
                match &mut own.shape {
                    Shape::Plane(p) => p.point_mm *= factor,
                    Shape::Sphere(s) => {
                        s.centre_mm *= factor;
                        s.radius_mm *= factor;
                    }
                    Shape::Cylinder(c) => {
                        c.point_mm *= factor;
                        c.radius_mm *= factor;
                    }
                    Shape::Cone(c) => c.apex_mm *= factor,
                    Shape::Torus(t) => {
                        t.centre_mm *= factor;
                        t.radius_mm *= factor;
                        t.tube_mm *= factor;
                    }
                }
                for i in 3..8 {
                    for j in 3..8 {
                        own.joint[(i, j)] *= factor * factor;
                    }
                }
                own
            })
            .collect();
        let settings = Settings {
            most_mm: 0.25 * factor,
            ..Settings::default()
        };
        let found = regularize(&scaled, &[], SIZE_MM * factor, &settings).unwrap();
        let is_of_numbers = |kind: Kind| {
            matches!(
                kind,
                Kind::RoundRadius | Kind::RoundDistance | Kind::RoundTubeRadius
            )
        };
        let kinds = found.accepted.iter().map(|own| own.kind);
        kinds
            .filter(|kind| !is_of_numbers(*kind))
            .collect::<Vec<_>>()
    };
    let one = count(1.0);
    assert!(one.len() >= 10, "{one:?}");
    assert_eq!(count(1e-2), one);
    assert_eq!(count(1e3), one);
}
