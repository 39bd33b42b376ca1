//! What regularities ask of the shapes that they tie, as equations.

use nalgebra::Vector3;
use shapes::Family;

use crate::chart::{Chart, HALF_ANGLE, RADIUS, Told, across};
use crate::touch::{axes_off, ball_mm, meridians_off};

/// Most equations of a rule.
pub(crate) const ROWS: usize = 3;

/// One size of one shape.
pub(crate) type Size = (usize, usize);

/// What is asked of shapes, which are told by their indices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rule {
    /// Directions are one, but for the sense.
    Aligned(usize, usize),
    /// Directions are at right angles.
    Orthogonal(usize, usize),
    /// Directions are at this angle, degrees.
    AtAngle(usize, usize, f64),
    /// A direction is that of an axis of the part frame.
    AlongFrame(usize, usize),
    /// A direction is at right angles to an axis of the part frame.
    AcrossFrame(usize, usize),
    /// Planes of one direction are one.
    Coplanar(usize, usize),
    /// Axes of one direction are one.
    Coaxial(usize, usize),
    /// A centre lies on an axis, which is the latter's.
    OnAxis(usize, usize),
    /// Centres are one.
    Concentric(usize, usize),
    /// Sizes are one.
    SameSize(Size, Size),
    /// What mirrors the one of a pair into the other is the same plane for both pairs.
    Mirrored([usize; 2], [usize; 2]),
    /// A centre or axis lies in the plane that mirrors the one of a pair into the other.
    Centred([usize; 2], usize),
    /// A size is so much, millimetres or radians.
    Round(Size, f64),
    /// Planes of one direction are so far apart, millimetres.
    PlanesApart(usize, usize, f64),
    /// Axes of one direction are so far apart, millimetres.
    AxesApart(usize, usize, f64),
    /// An axis runs so far from a plane, millimetres; the plane is the latter.
    AxisOffPlane(usize, usize, f64),
    /// A ball that rolls in the first touches a plane, which is the latter.
    TouchesPlane(usize, usize),
    /// A cone touches a plane, which is the latter.
    LiesOnPlane(usize, usize),
    /// Cylinders of one direction touch.
    AxesTouch(usize, usize),
    /// Surfaces about one axis, which the latter has, touch.
    MeridiansTouch(usize, usize),
    /// An axis touches the circle about which the tube of a torus runs, in its plane. The torus is
    /// the latter.
    AlongSpine(usize, usize),
    /// A centre lies on that circle.
    OnSpine(usize, usize),
}

/// What an equation is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    Angle,
    Length,
}

impl Rule {
    /// The shapes that it ties.
    pub(crate) fn shapes(&self) -> Vec<usize> {
        match *self {
            Self::AlongFrame(a, _) | Self::AcrossFrame(a, _) | Self::Round((a, _), _) => vec![a],
            Self::Aligned(a, b)
            | Self::Orthogonal(a, b)
            | Self::AtAngle(a, b, _)
            | Self::Coplanar(a, b)
            | Self::Coaxial(a, b)
            | Self::OnAxis(a, b)
            | Self::Concentric(a, b)
            | Self::SameSize((a, _), (b, _))
            | Self::PlanesApart(a, b, _)
            | Self::AxesApart(a, b, _)
            | Self::AxisOffPlane(a, b, _)
            | Self::TouchesPlane(a, b)
            | Self::LiesOnPlane(a, b)
            | Self::AxesTouch(a, b)
            | Self::MeridiansTouch(a, b)
            | Self::AlongSpine(a, b)
            | Self::OnSpine(a, b) => vec![a, b],
            Self::Mirrored([a, b], [c, d]) => vec![a, b, c, d],
            Self::Centred([a, b], c) => vec![a, b, c],
        }
    }

    /// Each equation's unit, and how far off it is at most of things that nothing ties: half the
    /// width of what it is spread over evenly. `size_mm` is that of the part.
    pub(crate) fn rows(&self, charts: &[Chart], size_mm: f64) -> Vec<(Unit, f64)> {
        /// Half the side of a square as large as half of the unit sphere, which all directions
        /// without a sense make up.
        const DIRECTION: f64 = 1.253_314_137_315_500_3;
        let direction = (Unit::Angle, DIRECTION);
        let place = (Unit::Length, 0.5 * size_mm);
        match *self {
            Self::Aligned(..) | Self::AlongFrame(..) => vec![direction; 2],
            Self::Orthogonal(..) | Self::AcrossFrame(..) => vec![(Unit::Angle, 1.0)],
            // The cosine is spread evenly from 0 to 1, but one may be off to both sides.
            Self::AtAngle(..) => vec![(Unit::Angle, 0.5)],
            Self::Coplanar(..)
            | Self::TouchesPlane(..)
            | Self::AxesTouch(..)
            | Self::MeridiansTouch(..) => vec![place],
            Self::LiesOnPlane(..) => vec![(Unit::Angle, 1.0), place],
            Self::Coaxial(..) | Self::OnAxis(..) | Self::AlongSpine(..) | Self::OnSpine(..) => {
                vec![place; 2]
            }
            Self::Concentric(..) => vec![place; 3],
            Self::SameSize((_, HALF_ANGLE), _) => vec![(Unit::Angle, 0.785)],
            Self::SameSize((a, i), (b, j)) => {
                let mean_mm = 0.5 * (charts[a].base.sizes[i] + charts[b].base.sizes[j]);
                vec![(Unit::Length, mean_mm)]
            }
            Self::Mirrored(..) => vec![direction, direction, place],
            Self::Centred(_, c) if charts[c].base.family == Family::Sphere => vec![place],
            Self::Centred(..) => vec![place, (Unit::Angle, 1.0)],
            // Their range is the grid's, which the caller knows.
            Self::Round((_, HALF_ANGLE), _) => vec![(Unit::Angle, f64::NAN)],
            Self::Round(..)
            | Self::PlanesApart(..)
            | Self::AxesApart(..)
            | Self::AxisOffPlane(..) => vec![(Unit::Length, f64::NAN)],
        }
    }

    /// How far off each equation is: sines and cosines for angles, millimetres for lengths.
    /// `at` tells shapes as they are, `charts` as they were.
    pub(crate) fn off(&self, at: &impl Fn(usize) -> Told, charts: &[Chart]) -> [f64; ROWS] {
        let one = |off: f64| [off, 0.0, 0.0];
        match *self {
            Self::Aligned(a, b) => {
                let [first, second] = across(&charts[a].base.direction);
                let (a, b) = (at(a).direction, at(b).direction);
                let apart = b * a.dot(&b).signum() - a;
                [apart.dot(&first), apart.dot(&second), 0.0]
            }
            Self::AlongFrame(a, axis) => {
                let direction = at(a).direction;
                [direction[(axis + 1) % 3], direction[(axis + 2) % 3], 0.0]
            }
            Self::Orthogonal(a, b) => one(at(a).direction.dot(&at(b).direction)),
            Self::AcrossFrame(a, axis) => one(at(a).direction[axis]),
            Self::AtAngle(a, b, degrees) => {
                let cos = at(a).direction.dot(&at(b).direction).abs();
                one(cos - libm::cos(degrees.to_radians()))
            }
            Self::Coplanar(a, b) => one(planes_apart(&at(a), &at(b))),
            Self::Coaxial(a, b) => {
                let [first, second] = across(&charts[a].base.direction);
                let apart = axes_apart(&at(a), &at(b));
                [apart.dot(&first), apart.dot(&second), 0.0]
            }
            Self::OnAxis(a, b) => {
                let [first, second] = across(&charts[b].base.direction);
                let (a, b) = (at(a), at(b));
                let apart = beside(&(a.place - b.place), &b.direction);
                [apart.dot(&first), apart.dot(&second), 0.0]
            }
            Self::Concentric(a, b) => (at(a).place - at(b).place).into(),
            Self::SameSize((a, i), (b, j)) => one(at(a).sizes[i] - at(b).sizes[j]),
            Self::Mirrored(one, other) => {
                let middle = middle(one.iter().chain(&other), charts);
                let across_it = across(&Mirror::of(&|k| charts[k].base, one, &middle).normal);
                let (a, b) = (Mirror::of(at, one, &middle), Mirror::of(at, other, &middle));
                let sense = a.normal.dot(&b.normal).signum();
                let apart = b.normal * sense - a.normal;
                let [first, second] = across_it;
                let offset = b.offset_mm * sense - a.offset_mm;
                [apart.dot(&first), apart.dot(&second), offset]
            }
            Self::Centred(pair, c) => {
                let middle = middle(pair.iter().chain([&c]), charts);
                let mirror = Mirror::of(at, pair, &middle);
                let c = at(c);
                let off_mm = mirror.normal.dot(&(c.place - middle)) - mirror.offset_mm;
                [off_mm, mirror.normal.dot(&c.direction), 0.0]
            }
            Self::Round((a, i), target) => one(at(a).sizes[i] - target),
            Self::PlanesApart(a, b, target) => one(planes_apart(&at(a), &at(b)).abs() - target),
            Self::AxesApart(a, b, target) => one(axes_apart(&at(a), &at(b)).norm() - target),
            Self::AxisOffPlane(a, b, target) => {
                let (a, b) = (at(a), at(b));
                one((a.place - b.place).dot(&b.direction).abs() - target)
            }
            Self::TouchesPlane(a, b) => {
                let (a, b) = (at(a), at(b));
                one((a.place - b.place).dot(&b.direction).abs() - ball_mm(&a))
            }
            Self::LiesOnPlane(a, b) => {
                let (a, b) = (at(a), at(b));
                let lean = a.direction.dot(&b.direction).abs();
                let apex_mm = (a.place - b.place).dot(&b.direction);
                [lean - libm::sin(a.sizes[HALF_ANGLE]), apex_mm, 0.0]
            }
            Self::AxesTouch(a, b) => {
                let bases = [a, b].map(|shape| &charts[shape].base);
                one(axes_off([&at(a), &at(b)], bases))
            }
            Self::MeridiansTouch(a, b) => {
                let bases = [a, b].map(|shape| &charts[shape].base);
                one(meridians_off([&at(a), &at(b)], bases))
            }
            Self::AlongSpine(a, b) => {
                let (a, b) = (at(a), at(b));
                off_spine(&beside(&(a.place - b.place), &a.direction), &b)
            }
            Self::OnSpine(a, b) => {
                let (a, b) = (at(a), at(b));
                off_spine(&(a.place - b.place), &b)
            }
        }
    }
}

/// How far something that lies there from the centre of a torus is off its spine: across its
/// plane, and in it.
fn off_spine(from_centre: &Vector3<f64>, torus: &Told) -> [f64; ROWS] {
    let across = from_centre.dot(&torus.direction);
    let out = beside(from_centre, &torus.direction).norm();
    [across, out - torus.sizes[RADIUS], 0.0]
}

/// The part of a vector across a direction.
fn beside(vector: &Vector3<f64>, direction: &Vector3<f64>) -> Vector3<f64> {
    vector - direction * vector.dot(direction)
}

/// The mean of two directions, in the sense of the first.
fn mean(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    (a + b * a.dot(b).signum()).normalize()
}

/// From a plane to one of the same direction, along the first's normal.
pub(crate) fn planes_apart(a: &Told, b: &Told) -> f64 {
    (b.place - a.place).dot(&mean(&a.direction, &b.direction))
}

/// From an axis to one of the same direction.
pub(crate) fn axes_apart(a: &Told, b: &Told) -> Vector3<f64> {
    beside(&(b.place - a.place), &mean(&a.direction, &b.direction))
}

/// The middle of where shapes were, so that what leans hardly shifts.
fn middle<'a>(shapes: impl Iterator<Item = &'a usize>, charts: &[Chart]) -> Vector3<f64> {
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for shape in shapes {
        sum += charts[*shape].base.place;
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

/// The plane that mirrors the one of two things into the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mirror {
    pub(crate) normal: Vector3<f64>,
    /// From a given place, along the normal.
    pub(crate) offset_mm: f64,
}

impl Mirror {
    /// Of two planes that are not alike, two axes of one direction, or two centres.
    pub(crate) fn of(at: &impl Fn(usize) -> Told, pair: [usize; 2], from: &Vector3<f64>) -> Self {
        let [a, b] = pair.map(at);
        if a.family == Family::Plane {
            let apart = a.direction - b.direction;
            let normal = apart.normalize();
            let height = |plane: &Told| plane.direction.dot(&(plane.place - from));
            // Twice the cosine between the mirror's normal and the planes'.
            let offset_mm = (height(&a) - height(&b)) / apart.norm();
            return Self { normal, offset_mm };
        }
        let apart = if a.family == Family::Sphere {
            b.place - a.place
        } else {
            axes_apart(&a, &b)
        };
        let normal = apart.normalize();
        let offset_mm = normal.dot(&(0.5 * (a.place + b.place) - from));
        Self { normal, offset_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapes::{Plane, Shape};

    #[test]
    fn a_mirror_maps_each_plane_into_the_other() {
        let plane = |normal: [f64; 3], point: [f64; 3]| {
            Chart::of(&Shape::Plane(Plane {
                point_mm: Vector3::from(point),
                normal: Vector3::from(normal).normalize(),
            }))
        };
        let charts = [
            plane([1.0, 0.2, 2.0], [4.0, 0.0, 1.0]),
            plane([-1.5, 0.1, 1.0], [-3.0, 2.0, 0.5]),
        ];
        let at = |k: usize| charts[k].base;
        let from = Vector3::new(0.3, -0.7, 0.1);
        let mirror = Mirror::of(&at, [0, 1], &from);
        // A point of the first, mirrored, lies on the second.
        let point = charts[0].base.place;
        let off = mirror.normal.dot(&(point - from)) - mirror.offset_mm;
        let mirrored = point - mirror.normal * (2.0 * off);
        assert!(charts[1].shape.distance_mm(&mirrored).abs() < 1e-12);
        let turned = charts[0].base.direction;
        let turned = turned - mirror.normal * (2.0 * turned.dot(&mirror.normal));
        assert!((turned - charts[1].base.direction).norm() < 1e-12);
    }
}
