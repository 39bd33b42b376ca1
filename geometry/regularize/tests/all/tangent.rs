//! Neighbours that go over into each other smoothly: every pair of kinds that can, by points of the
//! line in which the true ones touch.

#![allow(missing_docs, dead_code)]

use crate::common;

use core::f64::consts::TAU;

use common::{Chance, Known, SIZE_MM, WELL, after, cone, cylinder, fitted, plane, sphere, torus};
use nalgebra::{Rotation3, Vector3};
use regularize::{Fitted, Kind, Reason, Settings, join, regularize};
use shapes::Shape;

struct Pair {
    shapes: [Shape; 2],
    /// Where they touch.
    line_mm: Vec<Vector3<f64>>,
}

fn z(z: f64) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, z)
}

/// Places of a circle about the z axis.
fn about_z(radius_mm: f64, z_mm: f64) -> Vec<Vector3<f64>> {
    let turns = (0..8).map(|k| TAU * f64::from(k) / 8.0);
    let place = |turn: f64| {
        Vector3::new(
            radius_mm * libm::cos(turn),
            radius_mm * libm::sin(turn),
            z_mm,
        )
    };
    turns.map(place).collect()
}

/// Places of a circle in the x-z plane about (10, 0, 0).
fn across_spine(radius_mm: f64) -> Vec<Vector3<f64>> {
    let circle = about_z(radius_mm, 0.0).into_iter();
    circle
        .map(|place| Vector3::new(10.0 + place.x, 0.0, place.y))
        .collect()
}

fn straight(from: Vector3<f64>, way: Vector3<f64>) -> Vec<Vector3<f64>> {
    (0..6).map(|k| from + way * (3.0 * f64::from(k))).collect()
}

/// Every way in which surfaces touch along a line.
fn pairs() -> Vec<Pair> {
    let pair = |a, b, line_mm| Pair {
        shapes: [a, b],
        line_mm,
    };
    let (x, y) = (Vector3::x(), Vector3::y());
    let ground = plane(z(1.0), z(0.0));
    let ring = torus(z(1.0), z(0.0), 10.0, 3.0);
    let half_deg = 30.0_f64;
    let (sin, cos) = libm::sincos(half_deg.to_radians());
    let leaning = cone(Vector3::new(cos, 0.0, sin), z(0.0), half_deg);
    let upright = cone(z(1.0), z(0.0), half_deg);
    let above = (164.0_f64.sqrt() - 3.0, 164.0_f64.sqrt());
    let beside = |radius: f64, of: f64| about_z(10.0 * radius / of, 8.0 - 8.0 * radius / of);
    vec![
        pair(ground, cylinder(x, z(3.0), 3.0), straight(z(0.0), x)),
        pair(ground, leaning, straight(12.0 * x, x)),
        pair(ground, torus(z(1.0), z(3.0), 10.0, 3.0), about_z(10.0, 0.0)),
        pair(
            sphere(z(0.0), 5.0),
            cylinder(z(1.0), z(0.0), 5.0),
            about_z(5.0, 0.0),
        ),
        pair(
            sphere(z(10.0), 10.0 * sin),
            upright,
            about_z(10.0 * sin * cos, 10.0 * cos * cos),
        ),
        pair(sphere(z(8.0), above.0), ring, beside(above.0, above.1)),
        pair(
            sphere(z(8.0), above.1 + 3.0),
            ring,
            beside(above.1 + 3.0, above.1),
        ),
        pair(sphere(10.0 * x, 3.0), ring, across_spine(3.0)),
        pair(
            cylinder(y, z(0.0), 3.0),
            cylinder(y, Vector3::new(3.0, 0.0, -4.0), 2.0),
            straight(Vector3::new(1.8, 0.0, -2.4), y),
        ),
        pair(
            cylinder(y, z(0.0), 7.0),
            cylinder(y, Vector3::new(3.0, 0.0, -4.0), 2.0),
            straight(Vector3::new(4.2, 0.0, -5.6), y),
        ),
        pair(cylinder(z(1.0), z(0.0), 7.0), ring, about_z(7.0, 0.0)),
        pair(cylinder(z(1.0), z(0.0), 13.0), ring, about_z(13.0, 0.0)),
        pair(cylinder(y, 10.0 * x, 3.0), ring, across_spine(3.0)),
        pair(
            upright,
            torus(
                z(1.0),
                z(20.0 * cos - 2.0 * sin),
                20.0 * sin + 2.0 * cos,
                2.0,
            ),
            about_z(20.0 * sin, 20.0 * cos),
        ),
        pair(ring, torus(z(1.0), z(3.0), 14.0, 2.0), about_z(12.4, 1.8)),
    ]
}

fn moved(shape: &Shape, turn: &Rotation3<f64>, by: &Vector3<f64>) -> Shape {
    let mut shape = *shape;
    let (place, way) = match &mut shape {
        Shape::Plane(p) => (&mut p.point_mm, Some(&mut p.normal)),
        Shape::Sphere(s) => (&mut s.centre_mm, None),
        Shape::Cylinder(c) => (&mut c.point_mm, Some(&mut c.axis)),
        Shape::Cone(c) => (&mut c.apex_mm, Some(&mut c.axis)),
        Shape::Torus(t) => (&mut t.centre_mm, Some(&mut t.axis)),
    };
    *place = turn * *place + by;
    if let Some(way) = way {
        *way = turn * *way;
    }
    shape
}

/// Most that surfaces are apart near these places, each place taken to the first.
fn gap_mm([a, b]: &[Shape; 2], line_mm: &[Vector3<f64>]) -> f64 {
    let off = |place: &Vector3<f64>| {
        let mut on = *place;
        for _ in 0..3 {
            on -= a.normal(&on) * a.distance_mm(&on);
        }
        b.distance_mm(&on).abs()
    };
    line_mm.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn all_that_can_touch_does() {
    let mut chance = Chance::new(1);
    let turn = Rotation3::from_euler_angles(0.3, -0.5, 1.1);
    let by = Vector3::new(7.0, -11.0, 4.0);
    for (index, pair) in pairs().into_iter().enumerate() {
        let line_mm: Vec<_> = pair.line_mm.iter().map(|place| turn * place + by).collect();
        let truth = pair.shapes.map(|shape| moved(&shape, &turn, &by));
        assert!(
            gap_mm(&truth, &line_mm) < 1e-9,
            "pair {index} does not touch"
        );
        let (mut before_mm, mut after_mm, mut touched) = (0.0_f64, 0.0_f64, 0);
        for _ in 0..20 {
            let shapes = [
                chance.measured(1, &truth[0], WELL),
                chance.measured(2, &truth[1], WELL),
            ];
            let found = join(&shapes, &[[1, 2]], SIZE_MM);
            touched += found.accepted.len();
            before_mm = before_mm.max(gap_mm(&shapes.each_ref().map(|own| own.shape), &line_mm));
            if !found.accepted.is_empty() {
                assert_eq!(found.accepted[0].kind, Kind::Tangent);
                let after = after(&shapes, &found);
                after_mm = after_mm.max(gap_mm(&[after[0], after[1]], &line_mm));
            }
        }
        assert!(touched >= 19, "pair {index}: {touched} of 20");
        assert!(before_mm > 0.004, "pair {index}: {before_mm}");
        // Near where they touch they part by the square of how far.
        assert!(
            after_mm < 0.05 * before_mm,
            "pair {index}: {before_mm} to {after_mm}"
        );
    }
}

/// A fillet between two planes is nearly as sure as these.
#[test]
fn what_touches_is_surer() {
    let vague = Known {
        turn_rad: 5e-3,
        place_mm: 0.05,
        size: 0.05,
    };
    let shapes = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(2, plane(Vector3::x(), Vector3::zeros()), WELL),
        fitted(
            3,
            cylinder(Vector3::y(), Vector3::new(3.02, 0.0, 2.99), 3.03),
            vague,
        ),
    ];
    let found = join(&shapes, &[[1, 3], [2, 3]], SIZE_MM);
    assert_eq!(found.accepted.len(), 2);
    let fillet = found.adjusted.iter().find(|own| own.label == 3).unwrap();
    let direction = fillet.numbers.direction_rad.unwrap().covariance;
    assert!(
        direction.trace().sqrt() < 2.0 * WELL.turn_rad,
        "{direction}"
    );
    // Its radius alone is free still: the axis goes with it.
    let radius = fillet.numbers.radius_mm.unwrap();
    assert!(radius.deviation > 0.5 * vague.size / 3.0_f64.sqrt() && radius.deviation < vague.size);
    let Shape::Cylinder(cylinder) = fillet.shape else {
        panic!("{:?}", fillet.shape);
    };
    let off = [cylinder.point_mm.x, cylinder.point_mm.z].map(|at| at - cylinder.radius_mm);
    assert!(off.iter().all(|off| off.abs() < 0.01), "{off:?}");
}

#[test]
fn what_is_too_far_off_or_cannot_touch_stays() {
    let shapes = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(
            2,
            cylinder(Vector3::y(), Vector3::new(0.0, 0.0, 3.1), 3.0),
            WELL,
        ),
        fitted(3, plane(Vector3::x(), Vector3::zeros()), WELL),
    ];
    let found = join(&shapes, &[[1, 2], [1, 3], [2, 9]], SIZE_MM);
    assert_eq!(
        (&found.accepted[..], &found.adjusted[..]),
        (&[][..], &[][..])
    );
    let refused: Vec<_> = found
        .refused
        .iter()
        .map(|own| (&own.labels[..], own.reason))
        .collect();
    assert_eq!(refused, [(&[2, 1][..], Reason::TooFar)]);
}

/// The middle of a slot wider than its fillet touches the one side or the other.
#[test]
fn of_what_contradicts_the_likelier_holds() {
    let at = |z_mm: f64| plane(Vector3::z(), Vector3::new(0.0, 0.0, z_mm));
    let known = Known {
        place_mm: 0.012,
        ..WELL
    };
    let middle = Vector3::new(0.0, 0.0, 3.045);
    let shapes = [
        fitted(1, at(0.0), WELL),
        fitted(2, at(6.095), WELL),
        fitted(3, cylinder(Vector3::y(), middle, 3.0), known),
    ];
    let found = join(&shapes, &[[2, 3], [1, 3]], SIZE_MM);
    assert_eq!(found.accepted.len(), 1);
    assert_eq!(found.accepted[0].labels, [3, 1]);
    assert_eq!(found.refused[0].reason, Reason::Contradicted);
}

/// Regularities are sought among shapes that touch already.
#[test]
fn regularities_keep_what_touches() {
    let shapes = [
        fitted(1, plane(Vector3::z(), Vector3::zeros()), WELL),
        fitted(
            2,
            cylinder(Vector3::y(), Vector3::new(0.0, 0.0, 3.004), 3.0),
            WELL,
        ),
        fitted(
            3,
            cylinder(Vector3::y(), Vector3::new(31.0, 0.0, 17.0), 3.003),
            WELL,
        ),
    ];
    let found = regularize(&shapes, &[[1, 2]], SIZE_MM, &Settings::default()).unwrap();
    let kinds: Vec<_> = found.accepted.iter().map(|own| own.kind).collect();
    assert_eq!(kinds[0], Kind::Tangent);
    assert!(kinds.contains(&Kind::EqualRadii), "{kinds:?}");
    let after: Vec<Fitted> = after(&shapes, &found)
        .into_iter()
        .map(|shape| fitted(1, shape, WELL))
        .collect();
    let line_mm = straight(Vector3::zeros(), Vector3::y());
    assert!(gap_mm(&[after[0].shape, after[1].shape], &line_mm) < 1e-6);
}
