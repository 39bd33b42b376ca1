//! The shapes by the numbers that engineers know them by.

use core::fmt;

use nalgebra::Vector3;

/// A kind of surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// A plane: 3 free numbers.
    Plane,
    /// A sphere: 4.
    Sphere,
    /// A circular cylinder: 5.
    Cylinder,
    /// A circular cone: 6.
    Cone,
    /// A torus: 7.
    Torus,
}

impl Family {
    /// All of them, the simplest first.
    pub const ALL: [Self; 5] = [
        Self::Plane,
        Self::Sphere,
        Self::Cylinder,
        Self::Cone,
        Self::Torus,
    ];

    /// Its name in reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::Torus => "torus",
        }
    }

    /// How many numbers make one such surface.
    #[must_use]
    pub fn freedom(self) -> usize {
        match self {
            Self::Plane => 3,
            Self::Sphere => 4,
            Self::Cylinder => 5,
            Self::Cone => 6,
            Self::Torus => 7,
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// A point of it amid the samples, millimetres.
    pub point_mm: Vector3<f64>,
    /// Unit normal, towards the side that was seen.
    pub normal: Vector3<f64>,
}

/// A sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre, millimetres.
    pub centre_mm: Vector3<f64>,
    /// Its radius, millimetres.
    pub radius_mm: f64,
    /// Seen from within.
    pub is_hollow: bool,
}

/// A circular cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// The point of the axis beside the middle of the samples, millimetres.
    pub point_mm: Vector3<f64>,
    /// Unit direction of the axis.
    pub axis: Vector3<f64>,
    /// Its radius, millimetres.
    pub radius_mm: f64,
    /// Seen from within.
    pub is_hollow: bool,
}

/// A circular cone, one half of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Its apex, millimetres.
    pub apex_mm: Vector3<f64>,
    /// Unit direction of the axis, from the apex towards the samples.
    pub axis: Vector3<f64>,
    /// Angle between axis and surface, radians.
    pub half_angle_rad: f64,
    /// Seen from within.
    pub is_hollow: bool,
}

/// A torus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus {
    /// Its centre, millimetres.
    pub centre_mm: Vector3<f64>,
    /// Unit direction of the axis.
    pub axis: Vector3<f64>,
    /// Radius of the circle in the middle of the tube, millimetres.
    pub radius_mm: f64,
    /// Radius of the tube, millimetres.
    pub tube_mm: f64,
    /// The tube is seen from within.
    pub is_hollow: bool,
}

/// A surface of one of the families, in the part frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// See [`Plane`].
    Plane(Plane),
    /// See [`Sphere`].
    Sphere(Sphere),
    /// See [`Cylinder`].
    Cylinder(Cylinder),
    /// See [`Cone`].
    Cone(Cone),
    /// See [`Torus`].
    Torus(Torus),
}

impl Shape {
    /// Its family.
    #[must_use]
    pub fn family(&self) -> Family {
        match self {
            Self::Plane(_) => Family::Plane,
            Self::Sphere(_) => Family::Sphere,
            Self::Cylinder(_) => Family::Cylinder,
            Self::Cone(_) => Family::Cone,
            Self::Torus(_) => Family::Torus,
        }
    }

    /// Signed distance of a point, millimetres; positive on the side that was seen.
    #[must_use]
    pub fn distance_mm(&self, point_mm: &Vector3<f64>) -> f64 {
        let (off, is_hollow) = match self {
            Self::Plane(plane) => {
                return (point_mm - plane.point_mm).dot(&plane.normal);
            }
            Self::Sphere(sphere) => (
                (point_mm - sphere.centre_mm).norm() - sphere.radius_mm,
                sphere.is_hollow,
            ),
            Self::Cylinder(cylinder) => {
                let (_, out) = about(&(point_mm - cylinder.point_mm), &cylinder.axis);
                (out - cylinder.radius_mm, cylinder.is_hollow)
            }
            Self::Cone(cone) => {
                let (up, out) = about(&(point_mm - cone.apex_mm), &cone.axis);
                let (sin, cos) = libm::sincos(cone.half_angle_rad);
                (out * cos - up * sin, cone.is_hollow)
            }
            Self::Torus(torus) => {
                let (up, out) = about(&(point_mm - torus.centre_mm), &torus.axis);
                let off = out - torus.radius_mm;
                (
                    (off * off + up * up).sqrt() - torus.tube_mm,
                    torus.is_hollow,
                )
            }
        };
        if is_hollow { -off } else { off }
    }
}

/// How far along an axis through the origin, and how far off it.
fn about(from: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let up = from.dot(axis);
    (up, (from - axis * up).norm())
}
