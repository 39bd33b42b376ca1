//! Surfaces that go over into each other smoothly, as a fillet does into the faces beside it: along
//! a whole line they have one tangent plane.
//!
//! That makes conditions that each of both shapes alone does not show: the axis of a fillet runs
//! along the plane beside it, as far from it as the fillet's radius. With them the faces meet in
//! that line exactly, and a narrow fillet is known nearly as well as the wide faces beside it.

use shapes::Family;

use crate::chart::{Chart, HALF_ANGLE, RADIUS, TUBE, Told};
use crate::rule::{Rule, axes_apart};

/// The ways in which two shapes may touch along a line, each as the rules that make them do so.
pub(crate) fn ways(a: usize, b: usize, charts: &[Chart]) -> Vec<Vec<Rule>> {
    let family = |shape: usize| charts[shape].base.family;
    let (a, b) = if family(a) <= family(b) {
        (a, b)
    } else {
        (b, a)
    };
    // Of one axis, about which the line is a circle.
    let about_one_axis = vec![
        Rule::Aligned(a, b),
        Rule::Coaxial(a, b),
        Rule::MeridiansTouch(a, b),
    ];
    // A torus goes on as what its tube is there.
    let tubes = Rule::SameSize((a, RADIUS), (b, TUBE));
    match (family(a), family(b)) {
        (Family::Plane, Family::Cylinder) => {
            vec![vec![Rule::Orthogonal(b, a), Rule::TouchesPlane(b, a)]]
        }
        (Family::Plane, Family::Cone) => vec![vec![Rule::LiesOnPlane(b, a)]],
        (Family::Plane, Family::Torus) => {
            vec![vec![Rule::Aligned(a, b), Rule::TouchesPlane(b, a)]]
        }
        (Family::Sphere, Family::Cylinder | Family::Cone) => {
            vec![vec![Rule::OnAxis(a, b), Rule::MeridiansTouch(a, b)]]
        }
        (Family::Sphere, Family::Torus) => vec![
            vec![Rule::OnAxis(a, b), Rule::MeridiansTouch(a, b)],
            vec![tubes, Rule::OnSpine(a, b)],
        ],
        (Family::Cylinder, Family::Cylinder) => {
            vec![vec![Rule::Aligned(a, b), Rule::AxesTouch(a, b)]]
        }
        (Family::Cylinder, Family::Torus) => vec![
            about_one_axis,
            vec![tubes, Rule::Orthogonal(a, b), Rule::AlongSpine(a, b)],
        ],
        (Family::Cone | Family::Torus, Family::Torus) => vec![about_one_axis],
        _ => Vec::new(),
    }
}

/// Radius of the ball that rolls in a shape.
pub(crate) fn ball_mm(told: &Told) -> f64 {
    told.sizes[if told.family == Family::Torus {
        TUBE
    } else {
        RADIUS
    }]
}

/// How far cylinders of one direction are from touching: from the outside, or the one in the other.
/// `bases` tells which.
pub(crate) fn axes_off(told: [&Told; 2], bases: [&Told; 2]) -> f64 {
    let apart = |of: [&Told; 2]| axes_apart(of[0], of[1]).norm();
    let sizes = |of: [&Told; 2]| of.map(|shape| shape.sizes[RADIUS]);
    apart(told) - touching(sizes(told), apart(bases), sizes(bases))
}

/// How far apart centres of circles are that touch, of two ways the one that was nearer.
fn touching(radii: [f64; 2], was_apart: f64, were: [f64; 2]) -> f64 {
    let outside = (was_apart - (were[0] + were[1])).abs();
    let inside = (was_apart - (were[0] - were[1]).abs()).abs();
    if outside <= inside {
        radii[0] + radii[1]
    } else {
        (radii[0] - radii[1]) * (were[0] - were[1]).signum()
    }
}

/// What a plane through the axis cuts out of a surface about it: how far from the axis, how far
/// along it.
enum Meridian {
    /// A place on the line, and the way across it.
    Line([f64; 2], [f64; 2]),
    /// Centre and radius.
    Circle([f64; 2], f64),
}

/// Of a surface whose axis runs, but for the sense, along `axis`; from the place of this.
fn meridian(told: &Told, axis: &Told) -> Meridian {
    let along = (told.place - axis.place).dot(&axis.direction);
    match told.family {
        Family::Sphere => Meridian::Circle([0.0, along], told.sizes[RADIUS]),
        Family::Torus => Meridian::Circle([told.sizes[RADIUS], along], told.sizes[TUBE]),
        Family::Cone => {
            let (sin, cos) = libm::sincos(told.sizes[HALF_ANGLE]);
            let sense = told.direction.dot(&axis.direction).signum();
            Meridian::Line([0.0, along], [cos, -sin * sense])
        }
        Family::Cylinder | Family::Plane => Meridian::Line([told.sizes[RADIUS], along], [1.0, 0.0]),
    }
}

/// How far surfaces about one axis are from touching; `bases` tells in which way. The latter has an
/// axis.
pub(crate) fn meridians_off(told: [&Told; 2], bases: [&Told; 2]) -> f64 {
    let apart = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let norm = |v: [f64; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
    let of = |shapes: [&Told; 2]| shapes.map(|shape| meridian(shape, shapes[1]));
    match (of(told), of(bases)) {
        (
            [Meridian::Circle(a, r), Meridian::Circle(b, s)],
            [Meridian::Circle(c, t), Meridian::Circle(d, u)],
        ) => norm(apart(a, b)) - touching([r, s], norm(apart(c, d)), [t, u]),
        ([Meridian::Line(at, across), Meridian::Circle(centre, radius)], _)
        | ([Meridian::Circle(centre, radius), Meridian::Line(at, across)], _) => {
            let apart = apart(centre, at);
            (apart[0] * across[0] + apart[1] * across[1]).abs() - radius
        }
        _ => f64::NAN,
    }
}
