//! The true surface of a face, by the numbers that it is judged by.

use nalgebra::Vector3;
use shapes::Family;
use sim_scanner::Vec3;
use sim_scanner::scene::{FaceSurface, Surface};

/// A surface of one of the families.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrueSurface {
    pub(crate) family: Family,
    /// A point of a plane or of a cylinder's axis, a centre, or an apex, millimetres.
    pub(crate) place_mm: Vector3<f64>,
    /// Unit normal of a plane, unit axis else; a cone's from the apex towards the face.
    pub(crate) direction: Vector3<f64>,
    /// Of a sphere, a cylinder, or the circle in the middle of a torus's tube.
    pub(crate) radius_mm: f64,
    /// Of a torus's tube.
    pub(crate) tube_mm: f64,
    /// Of a cone.
    pub(crate) half_angle_rad: f64,
}

/// One of the free numbers of a surface: angles in radians, lengths in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Parameter {
    /// How far the direction leans towards a unit vector across it.
    Lean(Vector3<f64>),
    /// How far the place lies along a unit vector.
    Shift(Vector3<f64>),
    Radius,
    Tube,
    HalfAngle,
}

pub(crate) fn vector(v: Vec3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(crate) fn vec3(v: &Vector3<f64>) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// Two unit vectors across a direction, and across each other.
pub(crate) fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let aside = if direction.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let first = direction.cross(&aside).normalize();
    [first, direction.cross(&first)]
}

impl TrueSurface {
    /// As the simulator has it.
    pub(crate) fn of_scene(&self) -> FaceSurface {
        let (place_mm, axis) = (vec3(&self.place_mm), vec3(&self.direction));
        FaceSurface::Surface(match self.family {
            Family::Plane => Surface::Plane {
                normal: axis,
                offset_mm: self.direction.dot(&self.place_mm),
            },
            Family::Sphere => Surface::Sphere {
                centre_mm: place_mm,
                radius_mm: self.radius_mm,
            },
            Family::Cylinder => Surface::Cylinder {
                base_mm: place_mm,
                axis,
                radius_mm: self.radius_mm,
            },
            Family::Cone => Surface::Cone {
                apex_mm: place_mm,
                axis,
                half_angle_rad: self.half_angle_rad,
            },
            Family::Torus => {
                return FaceSurface::Torus {
                    centre_mm: place_mm,
                    axis,
                    radius_mm: self.radius_mm,
                    tube_mm: self.tube_mm,
                };
            }
        })
    }

    /// Signed distance of a point, millimetres.
    pub(crate) fn distance_mm(&self, point_mm: &Vector3<f64>) -> f64 {
        self.of_scene().signed_distance_mm(vec3(point_mm))
    }

    /// Unit normal beside a point, either way.
    pub(crate) fn normal(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        vector(self.of_scene().normal_at(vec3(point_mm)))
    }

    /// The same surface, told by the point of the plane or the axis that is nearest to another.
    pub(crate) fn told_beside(&self, point_mm: &Vector3<f64>) -> Self {
        let along = self.direction * self.direction.dot(&(point_mm - self.place_mm));
        let place_mm = match self.family {
            Family::Plane => point_mm - along,
            Family::Cylinder => self.place_mm + along,
            Family::Sphere | Family::Cone | Family::Torus => self.place_mm,
        };
        Self { place_mm, ..*self }
    }

    /// Its free numbers, as many as it has.
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let leans = || across(&self.direction).map(Parameter::Lean);
        let beside = || across(&self.direction).map(Parameter::Shift);
        let anywhere = [Vector3::x(), Vector3::y(), Vector3::z()].map(Parameter::Shift);
        let mut all = Vec::new();
        match self.family {
            Family::Plane => {
                all.extend(leans());
                all.push(Parameter::Shift(self.direction));
            }
            Family::Sphere => {
                all.push(Parameter::Radius);
                all.extend(anywhere);
            }
            Family::Cylinder => {
                all.push(Parameter::Radius);
                all.extend(leans());
                all.extend(beside());
            }
            Family::Cone => {
                all.push(Parameter::HalfAngle);
                all.extend(leans());
                all.extend(anywhere);
            }
            Family::Torus => {
                all.extend([Parameter::Radius, Parameter::Tube]);
                all.extend(leans());
                all.extend(anywhere);
            }
        }
        all
    }

    /// The surface with one number changed by a step.
    pub(crate) fn moved(&self, parameter: Parameter, step: f64) -> Self {
        let mut moved = *self;
        match parameter {
            Parameter::Lean(way) => moved.direction = (self.direction + way * step).normalize(),
            Parameter::Shift(way) => moved.place_mm += way * step,
            Parameter::Radius => moved.radius_mm += step,
            Parameter::Tube => moved.tube_mm += step,
            Parameter::HalfAngle => moved.half_angle_rad += step,
        }
        moved
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn surface(family: Family) -> TrueSurface {
        TrueSurface {
            family,
            place_mm: Vector3::new(1.0, -2.0, 3.0),
            direction: Vector3::new(0.1, 0.2, 1.0).normalize(),
            radius_mm: 20.0,
            tube_mm: 6.0,
            half_angle_rad: 0.5,
        }
    }

    #[test]
    fn a_surface_has_as_many_numbers_as_its_family() {
        for family in Family::ALL {
            assert_eq!(surface(family).parameters().len(), family.freedom());
        }
    }

    #[test]
    fn told_from_elsewhere_it_is_the_same_surface() {
        let (elsewhere, point) = (Vector3::new(9.0, 4.0, -7.0), Vector3::new(30.0, 12.0, 9.0));
        for family in Family::ALL {
            let here = surface(family);
            let told = here.told_beside(&elsewhere);
            let off = here.distance_mm(&point) - told.distance_mm(&point);
            assert!(off.abs() < 1e-9, "{family}: {off}");
        }
        let cylinder = surface(Family::Cylinder).told_beside(&elsewhere);
        let off = cylinder.direction.dot(&(elsewhere - cylinder.place_mm));
        assert!(off.abs() < 1e-9);
    }
}
