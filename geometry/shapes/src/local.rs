//! Shapes as they are seen from a place on them: by a frame there and by curvatures.
//!
//! Centres and axes run away to infinity as a surface becomes flat; curvatures only become
//! zero. So a fit works on these numbers (Lukacs, Martin and Marshall 1998, "Faithful
//! least-squares fitting of spheres, cylinders, cones and tori for reliable segmentation").

use core::f64::consts::PI;

use nalgebra::Vector3;

use crate::distance::Distances;
use crate::fit::Sample;
use crate::shape::{Cone, Cylinder, Family, Plane, Shape, Sphere, Torus};

/// Curvatures below this, per millimetre, have no centre to speak of.
const FLAT_PER_MM: f64 = 1e-9;

/// A shape seen from a place on it.
///
/// What `numbers` are depends on the family:
///
/// | family | 0 | 1 | 2 |
/// | --- | --- | --- | --- |
/// | sphere | curvature | | |
/// | cylinder, along `along` | curvature | | |
/// | cone, a generator along `along` | 1 / distance from the axis | half angle at the apex | |
/// | torus, a meridian along `along` | 1 / distance of the tube's centre from the axis | angle of the normal over the plane of the tube's centre | curvature of the tube |
///
/// Curvatures are per millimetre, and positive where the centre lies below the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Local {
    pub(crate) family: Family,
    /// The place, millimetres.
    pub(crate) place: Vector3<f64>,
    /// Unit normal there.
    pub(crate) normal: Vector3<f64>,
    /// Unit tangent there.
    pub(crate) along: Vector3<f64>,
    pub(crate) numbers: [f64; 3],
}

/// Numbers that a shape may have free, at most: those of a torus.
pub(crate) const MOST_FREE: usize = 7;
/// Indices of free numbers in a step: the shift along the normal, the turns of the normal
/// towards `along` and across it, the turn about the normal, and those of `numbers`. In this
/// order the free ones of every family come first.
pub(crate) const SHIFT: usize = 0;
pub(crate) const TILT_ALONG: usize = 1;
pub(crate) const TILT_ACROSS: usize = 2;
pub(crate) const TURN: usize = 4;
pub(crate) const NUMBERS: [usize; 3] = [3, 5, 6];

impl Local {
    /// How many numbers of a step are free; the others have no part in it.
    pub(crate) fn free(&self) -> usize {
        self.family.freedom()
    }

    /// How far samples lie off along their rays, in their standard deviations, positive above.
    pub(crate) fn offs(&self, samples: &[Sample]) -> impl Iterator<Item = f64> {
        let distances = self.distances();
        samples.iter().map(move |sample| distances.off(sample))
    }

    /// What tells distances from the shape.
    pub(crate) fn distances(&self) -> Distances {
        Distances::of(self)
    }

    /// The shape after a step.
    pub(crate) fn moved(&self, step: &[f64; MOST_FREE]) -> Self {
        let across = self.normal.cross(&self.along);
        let normal =
            (self.normal + self.along * step[TILT_ALONG] + across * step[TILT_ACROSS]).normalize();
        let along = self.along - self.normal * step[TILT_ALONG] + across * step[TURN];
        let along = (along - normal * along.dot(&normal)).normalize();
        let mut numbers = self.numbers;
        for (number, index) in numbers.iter_mut().zip(NUMBERS) {
            *number += step[index];
        }
        if matches!(self.family, Family::Cone | Family::Torus) {
            let [number, angle, _] = &mut numbers;
            // Half a turn makes the same shape of the opposite distance from the axis.
            let halves = (*angle / PI).round();
            *angle -= halves * PI;
            if halves.rem_euclid(2.0) != 0.0 {
                *number = -*number;
            }
        }
        Self {
            family: self.family,
            place: self.place + self.normal * step[SHIFT],
            normal,
            along,
            numbers,
        }
    }

    /// The same surface, seen from its other side.
    pub(crate) fn turned(&self) -> Self {
        Self {
            normal: -self.normal,
            numbers: self.numbers.map(|number| -number),
            ..*self
        }
    }

    /// The shape by its usual numbers; `None` where it is so flat that it has none.
    pub(crate) fn shape(&self) -> Option<Shape> {
        let centre = |curvature: f64| {
            (curvature.abs() > FLAT_PER_MM).then(|| self.place - self.normal / curvature)
        };
        let [number, second, third] = self.numbers;
        Some(match self.family {
            Family::Plane => Shape::Plane(Plane {
                point_mm: self.place,
                normal: self.normal,
            }),
            Family::Sphere => Shape::Sphere(Sphere {
                centre_mm: centre(number)?,
                radius_mm: (1.0 / number).abs(),
                is_hollow: number < 0.0,
            }),
            Family::Cylinder => Shape::Cylinder(Cylinder {
                point_mm: centre(number)?,
                axis: self.along,
                radius_mm: (1.0 / number).abs(),
                is_hollow: number < 0.0,
            }),
            Family::Cone => {
                if number.abs() <= FLAT_PER_MM {
                    return None;
                }
                let (sin, cos) = libm::sincos(second);
                let (axis, out) = (
                    self.along * cos - self.normal * sin,
                    self.along * sin + self.normal * cos,
                );
                let foot = self.place - out / number;
                // The radius grows along the axis for one sign of the angle, for a hollow
                // cone for the other.
                let growth = libm::tan(second);
                if growth.abs() <= FLAT_PER_MM {
                    return None;
                }
                let apex_mm = foot - axis / (number * growth);
                let towards = (self.place - apex_mm).dot(&axis).signum();
                Shape::Cone(Cone {
                    apex_mm,
                    axis: axis * towards,
                    half_angle_rad: second.abs(),
                    is_hollow: number < 0.0,
                })
            }
            Family::Torus => {
                let tube = centre(third)?;
                if number.abs() <= FLAT_PER_MM {
                    return None;
                }
                let (sin, cos) = libm::sincos(second);
                let out = self.normal * cos - self.along * sin;
                Shape::Torus(Torus {
                    centre_mm: tube - out / number,
                    axis: self.normal * sin + self.along * cos,
                    radius_mm: (1.0 / number).abs(),
                    tube_mm: (1.0 / third).abs(),
                    is_hollow: third < 0.0,
                })
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn local(family: Family, numbers: [f64; 3]) -> Local {
        let normal = Vector3::new(0.2, -0.3, 0.9).normalize();
        let along = Vector3::new(1.0, 0.5, 0.0);
        Local {
            family,
            place: Vector3::new(3.0, -2.0, 7.0),
            normal,
            along: (along - normal * along.dot(&normal)).normalize(),
            numbers,
        }
    }

    fn all() -> Vec<Local> {
        vec![
            local(Family::Plane, [0.0; 3]),
            local(Family::Sphere, [0.04, 0.0, 0.0]),
            local(Family::Sphere, [-0.04, 0.0, 0.0]),
            local(Family::Sphere, [0.0; 3]),
            local(Family::Cylinder, [0.1, 0.0, 0.0]),
            local(Family::Cylinder, [-0.1, 0.0, 0.0]),
            local(Family::Cone, [0.1, 0.3, 0.0]),
            local(Family::Cone, [0.1, -0.3, 0.0]),
            local(Family::Cone, [-0.1, 0.3, 0.0]),
            local(Family::Torus, [0.05, 0.4, 0.2]),
            local(Family::Torus, [-0.05, 0.4, 0.2]),
            local(Family::Torus, [0.05, -0.4, -0.2]),
        ]
    }

    fn points() -> impl Iterator<Item = Vector3<f64>> {
        (0..40).map(|k| {
            let at = |m: f64| 3.0 * libm::sin(f64::from(k) * m + m);
            Vector3::new(3.0 + at(1.3), -2.0 + at(0.7), 7.0 + 0.3 * at(2.1))
        })
    }

    #[test]
    fn the_usual_numbers_tell_the_same_distance() {
        for local in all() {
            let Some(shape) = local.shape() else {
                assert_eq!(local.numbers[0], 0.0);
                continue;
            };
            for point in points() {
                let (near, far) = (
                    local.distances().distance(&point),
                    shape.distance_mm(&point),
                );
                assert!((near - far).abs() < 1e-9, "{shape:?}: {near} {far}");
            }
        }
    }

    #[test]
    fn from_its_other_side_a_surface_is_the_same() {
        for local in all() {
            let turned = local.turned();
            for point in points() {
                let [one, other] = [&local, &turned].map(|l| l.distances().distance(&point));
                assert!((one + other).abs() < 1e-9, "{local:?}: {one} {other}");
            }
            assert_eq!(turned.turned().numbers, local.numbers);
        }
    }

    #[test]
    fn derivatives_are_those_of_a_small_step() {
        const STEP: f64 = 1e-6;
        for local in all() {
            let distances = local.distances();
            for point in points() {
                let sample = Sample {
                    point_mm: point,
                    ray: Vector3::new(0.1, 0.2, 1.0).normalize(),
                    sigma_mm: 0.05,
                };
                type Plain<'a> = &'a dyn Fn(&Local) -> f64;
                let distance: Plain<'_> = &|local| local.distances().distance(&point);
                let off: Plain<'_> = &|local| local.distances().off(&sample);
                for (sloped, close, plain) in [
                    (distances.sloped_distance(&point), 1e-5, distance),
                    // What the way along the ray changes by is left out.
                    (distances.sloped_off(&sample), 1e-2, off),
                ] {
                    assert_eq!(sloped.value, plain(&local));
                    for k in 0..local.free() {
                        let moved = |by: f64| {
                            let mut step = [0.0; MOST_FREE];
                            step[k] = by;
                            plain(&local.moved(&step))
                        };
                        let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                        let off = (slope - sloped.by[k]).abs();
                        assert!(
                            off < close * (1.0 + slope.abs()),
                            "{local:?} {k}: {slope} {}",
                            sloped.by[k]
                        );
                    }
                }
            }
        }
    }
}
