//! How well the numbers of a fitted shape are known.

use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};

use crate::local::{Local, MOST_FREE};
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
    /// How a plane's normal or an axis may be off, radians.
    pub direction_rad: Option<Spread>,
    /// How the place may be off in the ways that count, millimetres: along a plane's normal,
    /// across a cylinder's axis, all ways of a centre or apex.
    pub place_mm: Spread,
}

/// How a vector may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Its covariance.
    pub covariance: Matrix3<f64>,
}

impl Spread {
    /// Standard deviation along a unit vector.
    #[must_use]
    pub fn along(&self, way: &Vector3<f64>) -> f64 {
        way.dot(&(self.covariance * way)).max(0.0).sqrt()
    }

    /// Standard deviation in the way in which it is known least.
    #[must_use]
    pub fn most(&self) -> f64 {
        let eigen = SymmetricEigen::new(self.covariance);
        eigen.eigenvalues.max().max(0.0).sqrt()
    }

    /// The same, looked at in these perpendicular unit ways only.
    fn only(&self, ways: &[Vector3<f64>]) -> Self {
        let kept: Matrix3<f64> = ways.iter().map(|way| way * way.transpose()).sum();
        Self {
            covariance: kept * self.covariance * kept,
        }
    }
}

/// Covariance of all that a shape's numbers are, to first order: of its direction (a plane's
/// normal, an axis) and its place (as [`Numbers::place_mm`] has them), each by its three
/// coordinates, and then of the radius, the tube's radius and the half angle. What a shape does
/// not have varies in nothing; where an axis' point slides along it, that counts as variation,
/// though it means none. Millimetres and radians.
pub type Joint = SMatrix<f64, 9, 9>;

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

/// What a shape is told as, by each of its free numbers. `None` where a small step makes it
/// another shape.
fn slopes(local: &Local, covariance: &SMatrix<f64, MOST_FREE, MOST_FREE>) -> Option<Vec<Told>> {
    let free = local.free();
    let mut slopes = Vec::with_capacity(free);
    for k in 0..free {
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
    Some(slopes)
}

/// The joint covariance of a shape whose free numbers have this one. `None` as with [`numbers`].
pub(crate) fn joint(
    local: &Local,
    covariance: &SMatrix<f64, MOST_FREE, MOST_FREE>,
) -> Option<Joint> {
    let slopes: Vec<SVector<f64, 9>> = slopes(local, covariance)?
        .iter()
        .map(|told| {
            let (d, p) = (told.direction, told.place);
            let sizes = [told.radius, told.tube, told.half_angle];
            SVector::from([d.x, d.y, d.z, p.x, p.y, p.z, sizes[0], sizes[1], sizes[2]])
        })
        .collect();
    let mut joint = Joint::zeros();
    for (row, one) in slopes.iter().enumerate() {
        for (column, other) in slopes.iter().enumerate() {
            joint += one * other.transpose() * covariance[(row, column)];
        }
    }
    Some(joint)
}

/// The numbers of a shape whose free numbers have this covariance. `None` where a small
/// step makes it another shape.
pub(crate) fn numbers(
    local: &Local,
    covariance: &SMatrix<f64, MOST_FREE, MOST_FREE>,
) -> Option<Numbers> {
    let shape = local.shape()?;
    let here = Told::of(&shape);
    let slopes = slopes(local, covariance)?;
    let common = |a: &dyn Fn(&Told) -> f64, b: &dyn Fn(&Told) -> f64| -> f64 {
        let mut sum = 0.0;
        for (row, one) in slopes.iter().enumerate() {
            for (column, other) in slopes.iter().enumerate() {
                sum += a(one) * covariance[(row, column)] * b(other);
            }
        }
        sum
    };
    let measured = |value: f64, slope: &dyn Fn(&Told) -> f64| Measured {
        value,
        deviation: common(slope, slope).max(0.0).sqrt(),
    };
    let spread = |vector: &dyn Fn(&Told) -> Vector3<f64>| Spread {
        covariance: Matrix3::from_fn(|i, j| common(&|t| vector(t)[i], &|t| vector(t)[j])),
    };
    let radius = || measured(here.radius, &|t| t.radius);
    let direction = || Some(spread(&|t| t.direction));
    let mut numbers = Numbers {
        radius_mm: None,
        tube_mm: None,
        half_angle_rad: None,
        direction_rad: None,
        place_mm: spread(&|t| t.place),
    };
    match shape {
        Shape::Plane(_) => {
            numbers.direction_rad = direction();
            numbers.place_mm = numbers.place_mm.only(&[here.direction]);
        }
        Shape::Sphere(_) => numbers.radius_mm = Some(radius()),
        Shape::Cylinder(_) => {
            numbers.radius_mm = Some(radius());
            numbers.direction_rad = direction();
            let (first, second) = across(&here.direction);
            numbers.place_mm = numbers.place_mm.only(&[first, second]);
        }
        Shape::Cone(_) => {
            numbers.half_angle_rad = Some(measured(here.half_angle, &|t| t.half_angle));
            numbers.direction_rad = direction();
        }
        Shape::Torus(_) => {
            numbers.radius_mm = Some(radius());
            numbers.tube_mm = Some(measured(here.tube, &|t| t.tube));
            numbers.direction_rad = direction();
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
