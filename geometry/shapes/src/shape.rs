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

    /// Unit normal beside a point, towards the side that was seen: the gradient of
    /// [`Shape::distance_mm`]. Not a number on an axis, where there is none.
    #[must_use]
    pub fn normal(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        let (normal, is_hollow) = match self {
            Self::Plane(plane) => return plane.normal,
            Self::Sphere(sphere) => ((point_mm - sphere.centre_mm).normalize(), sphere.is_hollow),
            Self::Cylinder(cylinder) => {
                let from = point_mm - cylinder.point_mm;
                (outwards(&from, &cylinder.axis), cylinder.is_hollow)
            }
            Self::Cone(cone) => {
                let out = outwards(&(point_mm - cone.apex_mm), &cone.axis);
                let (sin, cos) = libm::sincos(cone.half_angle_rad);
                (out * cos - cone.axis * sin, cone.is_hollow)
            }
            Self::Torus(torus) => {
                let from = point_mm - torus.centre_mm;
                let middle = outwards(&from, &torus.axis) * torus.radius_mm;
                ((from - middle).normalize(), torus.is_hollow)
            }
        };
        if is_hollow { -normal } else { normal }
    }

    /// z of the surface over a place in the x-y plane, where its seen side faces +z; the one that
    /// descending from `near_mm` leads to. `None` where it does not lead to any.
    #[must_use]
    pub fn z_mm(&self, x_mm: f64, y_mm: f64, near_mm: f64) -> Option<f64> {
        let mut point_mm = Vector3::new(x_mm, y_mm, near_mm);
        for _ in 0..MOST_STEPS {
            let off_mm = self.distance_mm(&point_mm);
            let facing = self.normal(&point_mm).z;
            if off_mm.abs() < NEAR_ENOUGH_MM {
                return (facing > LEAST_FACING).then_some(point_mm.z);
            }
            if facing.is_nan() || facing <= LEAST_FACING {
                return None;
            }
            point_mm.z -= off_mm / facing;
        }
        None
    }
}

/// Steps of Newton's method; it doubles the digits, but for grazing rays.
const MOST_STEPS: usize = 60;
/// Distance at which a point lies on a surface, millimetres.
const NEAR_ENOUGH_MM: f64 = 1e-10;
/// Cosine between z and the normal below which a surface is seen edge on.
const LEAST_FACING: f64 = 0.01;

/// Unit vector away from an axis through the origin.
fn outwards(from: &Vector3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    (from - axis * from.dot(axis)).normalize()
}

/// How far along an axis through the origin, and how far off it.
fn about(from: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let up = from.dot(axis);
    (up, (from - axis * up).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> [Shape; 8] {
        let axis = Vector3::new(0.3, 0.9, 0.1).normalize();
        let point_mm = Vector3::new(1.0, -2.0, 3.0);
        let cylinder = |is_hollow| {
            Shape::Cylinder(Cylinder {
                point_mm,
                axis,
                radius_mm: 12.0,
                is_hollow,
            })
        };
        let torus = |is_hollow| {
            Shape::Torus(Torus {
                centre_mm: point_mm,
                axis: Vector3::new(0.1, 0.2, 1.0).normalize(),
                radius_mm: 20.0,
                tube_mm: 6.0,
                is_hollow,
            })
        };
        [
            Shape::Plane(Plane {
                point_mm,
                normal: Vector3::new(0.5, -0.3, 0.8).normalize(),
            }),
            Shape::Sphere(Sphere {
                centre_mm: point_mm,
                radius_mm: 15.0,
                is_hollow: false,
            }),
            Shape::Sphere(Sphere {
                centre_mm: point_mm,
                radius_mm: 15.0,
                is_hollow: true,
            }),
            cylinder(false),
            cylinder(true),
            Shape::Cone(Cone {
                apex_mm: Vector3::new(-30.0, 0.0, 0.0),
                axis: Vector3::new(1.0, 0.1, -0.2).normalize(),
                half_angle_rad: 0.4,
                is_hollow: false,
            }),
            torus(false),
            torus(true),
        ]
    }

    #[test]
    fn normals_are_the_gradient_of_the_distance() {
        let point_mm = Vector3::new(9.0, 5.0, 8.0);
        for shape in all() {
            let step = 1e-5;
            let gradient = Vector3::from_fn(|d, _| {
                let by = Vector3::ith(d, step);
                (shape.distance_mm(&(point_mm + by)) - shape.distance_mm(&(point_mm - by)))
                    / (2.0 * step)
            });
            let off = (gradient - shape.normal(&point_mm)).norm();
            assert!(off < 1e-8, "{shape:?}: {off}");
        }
    }

    #[test]
    fn a_surface_is_met_where_its_seen_side_faces_up() {
        for shape in all() {
            let mut met = 0;
            for (i, j) in (-20..=20).flat_map(|i| (-20..=20).map(move |j| (i, j))) {
                let (x_mm, y_mm) = (f64::from(i), f64::from(j));
                // From somewhat off the surface, above or below.
                for near_mm in [-9.0, 2.0, 12.0, 18.0] {
                    let Some(z_mm) = shape.z_mm(x_mm, y_mm, near_mm) else {
                        continue;
                    };
                    let point_mm = Vector3::new(x_mm, y_mm, z_mm);
                    assert!(shape.distance_mm(&point_mm).abs() < 1e-9);
                    assert!(shape.normal(&point_mm).z > 0.0);
                    met += 1;
                }
            }
            assert!(met > 200, "{shape:?}: {met}");
        }
    }

    #[test]
    fn beyond_its_outline_a_surface_is_not_met() {
        let sphere = all()[1];
        assert_eq!(sphere.z_mm(1.0, -2.0, 17.0), Some(18.0));
        assert_eq!(sphere.z_mm(17.0, -2.0, 3.0), None);
        assert_eq!(sphere.z_mm(f64::NAN, 0.0, 0.0), None);
    }
}
