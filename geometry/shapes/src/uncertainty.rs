//! How well the numbers of a fitted shape are known.

use nalgebra::{SMatrix, Vector3};

use crate::jet::MOST_FREE;
use crate::local::Local;
use crate::shape::Shape;

/// A number and its standard uncertainty, in the number's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

/// The numbers of a shape, with standard uncertainties to first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// Radius of a sphere or a cylinder, or of the circle in the middle of a torus's tube,
    /// millimetres.
    pub radius_mm: Option<Measured>,
    /// Radius of a torus's tube, millimetres.
    pub tube_mm: Option<Measured>,
    /// Angle between a cone's axis and surface, radians.
    pub half_angle_rad: Option<Measured>,
    /// Standard deviation of the direction, of a plane's normal or an axis, in each of the two
    /// ways it can tilt, root mean square, radians.
    pub direction_rad: Option<f64>,
    /// Standard deviation of the place along each of its axes, root mean square over those
    /// that count, millimetres: along a plane's normal, across a cylinder's axis, all three of
    /// a centre or apex.
    pub place_mm: f64,
}

/// Step by which derivatives are taken, in standard deviations.
const STEP: f64 = 1e-2;

/// A shape as numbers to be told.
struct Told {
    radius: f64,
    tube: f64,
    half_angle: f64,
    direction: Vector3<f64>,
    place: Vector3<f64>,
}

impl Told {
    fn of(shape: &Shape) -> Self {
        let told = |radius, tube, half_angle, direction, place| Self {
            radius,
            tube,
            half_angle,
            direction,
            place,
        };
        let none = Vector3::zeros();
        match shape {
            Shape::Plane(p) => told(0.0, 0.0, 0.0, p.normal, p.point_mm),
            Shape::Sphere(s) => told(s.radius_mm, 0.0, 0.0, none, s.centre_mm),
            Shape::Cylinder(c) => told(c.radius_mm, 0.0, 0.0, c.axis, c.point_mm),
            Shape::Cone(c) => told(0.0, 0.0, c.half_angle_rad, c.axis, c.apex_mm),
            Shape::Torus(t) => told(t.radius_mm, t.tube_mm, 0.0, t.axis, t.centre_mm),
        }
    }
}

/// The numbers of a shape whose free numbers have this covariance. `None` where a small
/// step makes it another shape.
pub(crate) fn numbers(
    local: &Local,
    covariance: &SMatrix<f64, MOST_FREE, MOST_FREE>,
) -> Option<Numbers> {
    let shape = local.shape()?;
    let here = Told::of(&shape);
    let free = local.free();
    let mut slopes = Vec::with_capacity(free.len());
    for &k in free {
        let size = STEP * covariance[(k, k)].max(0.0).sqrt();
        let at = |size: f64| {
            let mut step = [0.0; MOST_FREE];
            step[k] = size;
            Some(Told::of(&local.moved(&step).shape()?))
        };
        let (up, down) = (at(size)?, at(-size)?);
        let per = if size > 0.0 { 0.5 / size } else { 0.0 };
        slopes.push(Told {
            radius: (up.radius - down.radius) * per,
            tube: (up.tube - down.tube) * per,
            half_angle: (up.half_angle - down.half_angle) * per,
            direction: (up.direction - down.direction) * per,
            place: (up.place - down.place) * per,
        });
    }
    let variance = |slope: &dyn Fn(&Told) -> f64| -> f64 {
        let mut sum = 0.0;
        for (i, &row) in free.iter().enumerate() {
            for (j, &column) in free.iter().enumerate() {
                sum += slope(&slopes[i]) * covariance[(row, column)] * slope(&slopes[j]);
            }
        }
        sum.max(0.0)
    };
    let measured = |value: f64, slope: &dyn Fn(&Told) -> f64| Measured {
        value,
        deviation: variance(slope).sqrt(),
    };
    let radius = || measured(here.radius, &|t| t.radius);
    // The ways in which a place may be off that count: `along` is the direction if only that
    // counts, or if only that does not.
    let place = |counts: [Vector3<f64>; 3], ways: usize| {
        let ways = &counts[..ways];
        let sum: f64 = ways.iter().map(|w| variance(&|t| t.place.dot(w))).sum();
        (sum / ways.len() as f64).sqrt()
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let (first, second) = across(&here.direction);
    let tilt = || {
        let sum = variance(&|t| t.direction.dot(&first)) + variance(&|t| t.direction.dot(&second));
        (0.5 * sum).sqrt()
    };
    let mut numbers = Numbers {
        radius_mm: None,
        tube_mm: None,
        half_angle_rad: None,
        direction_rad: None,
        place_mm: place(axes, 3),
    };
    match shape {
        Shape::Plane(_) => {
            numbers.direction_rad = Some(tilt());
            numbers.place_mm = place([here.direction; 3], 1);
        }
        Shape::Sphere(_) => numbers.radius_mm = Some(radius()),
        Shape::Cylinder(_) => {
            numbers.radius_mm = Some(radius());
            numbers.direction_rad = Some(tilt());
            numbers.place_mm = place([first, second, here.direction], 2);
        }
        Shape::Cone(_) => {
            numbers.half_angle_rad = Some(measured(here.half_angle, &|t| t.half_angle));
            numbers.direction_rad = Some(tilt());
        }
        Shape::Torus(_) => {
            numbers.radius_mm = Some(radius());
            numbers.tube_mm = Some(measured(here.tube, &|t| t.tube));
            numbers.direction_rad = Some(tilt());
        }
    }
    Some(numbers)
}

/// Two unit directions across one, and across each other.
fn across(direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let least = direction.iamin();
    let mut off = Vector3::zeros();
    off[least] = 1.0;
    let first = direction.cross(&off);
    let first = first / first.norm().max(f64::MIN_POSITIVE);
    (first, direction.cross(&first))
}
