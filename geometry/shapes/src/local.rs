//! Shapes as they are seen from a place on them: by a frame there and by curvatures.
//!
//! Centres and axes run away to infinity as a surface becomes flat; curvatures only become
//! zero. So a fit works on these numbers (Lukacs, Martin and Marshall 1998, "Faithful
//! least-squares fitting of spheres, cylinders, cones and tori for reliable segmentation").

use core::f64::consts::PI;

use nalgebra::Vector3;

use crate::fit::{ACROSS, Sample};
use crate::jet::{MOST_FREE, Scalar};
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

/// Indices of free numbers in a step: the shift along the normal, the turns of the normal
/// towards `along` and across it, the turn about the normal, and then `numbers`.
const SHIFT: usize = 0;
const TILT_ALONG: usize = 1;
const TILT_ACROSS: usize = 2;
const TURN: usize = 3;
const NUMBERS: usize = 4;

impl Local {
    /// Which numbers of a step are free.
    pub(crate) fn free(&self) -> &'static [usize] {
        match self.family {
            Family::Plane => &[0, 1, 2],
            Family::Sphere => &[0, 1, 2, 4],
            Family::Cylinder => &[0, 1, 2, 3, 4],
            Family::Cone => &[0, 1, 2, 3, 4, 5],
            Family::Torus => &[0, 1, 2, 3, 4, 5, 6],
        }
    }

    /// How far samples lie off along their rays, in their standard deviations, positive above.
    pub(crate) fn offs(&self, samples: &[Sample]) -> impl Iterator<Item = f64> {
        let distances = self.distances::<f64>();
        samples.iter().map(move |sample| distances.off(sample))
    }

    /// Tells distances from the shape, with their derivatives by the numbers of a step.
    pub(crate) fn distances<S: Scalar>(&self) -> Distances<'_, S> {
        let [first, second, third] = [0, 1, 2].map(|k| S::free(self.numbers[k], NUMBERS + k));
        let nothing = S::constant(0.0);
        Distances {
            local: self,
            across: self.normal.cross(&self.along),
            first,
            angle: match self.family {
                Family::Cone | Family::Torus => second.sin_cos(),
                _ => (nothing, nothing),
            },
            tube: match self.family {
                Family::Torus => third.recip(),
                _ => nothing,
            },
        }
    }

    /// The shape after a step.
    pub(crate) fn moved(&self, step: &[f64; MOST_FREE]) -> Self {
        let across = self.normal.cross(&self.along);
        let normal =
            (self.normal + self.along * step[TILT_ALONG] + across * step[TILT_ACROSS]).normalize();
        let along = self.along - self.normal * step[TILT_ALONG] + across * step[TURN];
        let along = (along - normal * along.dot(&normal)).normalize();
        let mut numbers = self.numbers;
        for (number, change) in numbers.iter_mut().zip(&step[NUMBERS..]) {
            *number += change;
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

/// What tells distances from a shape: what is the same for all points is worked out once.
pub(crate) struct Distances<'a, S> {
    local: &'a Local,
    across: Vector3<f64>,
    /// The first of the shape's numbers: a curvature, or 1 / distance from the axis.
    first: S,
    /// Sine and cosine of the second.
    angle: (S, S),
    /// Radius of a torus's tube, negative where it is hollow.
    tube: S,
}

impl<S: Scalar> Distances<'_, S> {
    /// Signed distance of a point, millimetres, positive above.
    pub(crate) fn distance(&self, point: &Vector3<f64>) -> S {
        let from = point - self.local.place;
        let (u, v, s) = (
            from.dot(&self.local.along),
            from.dot(&self.across),
            from.dot(&self.local.normal),
        );
        let along = S::varying(u, [(TILT_ALONG, -s), (TURN, v)]);
        let across = S::varying(v, [(TILT_ACROSS, -s), (TURN, -u)]);
        let s = S::varying(s, [(SHIFT, -1.0), (TILT_ALONG, u), (TILT_ACROSS, v)]);
        let first = self.first;
        let (sin, cos) = self.angle;
        match self.local.family {
            Family::Plane => s,
            Family::Sphere => off_round(first, along * along + across * across + s * s, s),
            Family::Cylinder => off_round(first, across * across + s * s, s),
            Family::Cone => {
                let out = sin * along + cos * s;
                let up = cos * along - sin * s;
                cos * off_round(first, across * across + out * out, out) - sin * up
            }
            Family::Torus => {
                let raised = s + self.tube;
                let out = cos * raised - sin * along;
                let up = sin * raised + cos * along;
                let off = off_round(first, across * across + out * out, out);
                let from_centre = (off * off + up * up).sqrt();
                if self.tube.value() < 0.0 {
                    -from_centre - self.tube
                } else {
                    from_centre - self.tube
                }
            }
        }
    }

    /// How far a sample lies off along its ray, in its standard deviations, positive above: the
    /// distance over the share of it that the ray covers on its way to the surface.
    pub(crate) fn off(&self, sample: &Sample) -> S {
        let here = self.distance(&sample.point_mm);
        here * self.deviation_from(here, sample).recip()
    }

    /// Standard deviation of a sample's distance, millimetres.
    pub(crate) fn deviation_mm(&self, sample: &Sample) -> S {
        self.deviation_from(self.distance(&sample.point_mm), sample)
    }

    fn deviation_from(&self, here: S, sample: &Sample) -> S {
        /// How far along the ray the distance is looked at once more, millimetres, at least, and
        /// at most, in the sample's deviations.
        const STEP_MM: f64 = 1e-3;
        const MOST: f64 = 4.0;
        // The share covered at the sample is not that half way to the surface: where a surface
        // turns away, samples before it would count otherwise than those behind, and the radius
        // of a rod of 3 mm seen to 75 degrees would be off by four times its uncertainty.
        let plain = self.plain();
        let distance = here.value();
        let further = plain.distance(&(sample.point_mm + sample.ray * STEP_MM));
        let covered = (further - distance) / STEP_MM;
        let back = distance / covered.abs().max(ACROSS).copysign(covered);
        let most = (MOST * sample.sigma_mm).max(STEP_MM);
        let back = back.clamp(-most, most);
        let back = back.abs().max(STEP_MM).copysign(back);
        let there = self.distance(&(sample.point_mm - sample.ray * back));
        let covered = (here - there) * (1.0 / back);
        (covered * covered + ACROSS * ACROSS).sqrt() * sample.sigma_mm
    }

    /// The same without derivatives.
    fn plain(&self) -> Distances<'_, f64> {
        Distances {
            local: self.local,
            across: self.across,
            first: self.first.value(),
            angle: (self.angle.0.value(), self.angle.1.value()),
            tube: self.tube.value(),
        }
    }
}

/// How much farther a point is from the centre of a circle than the circle, which passes
/// through the origin with this curvature: from the point's squared distance to the origin
/// and how far it is above it. As the curvature goes to zero this becomes the height.
fn off_round<S: Scalar>(curvature: S, distance2: S, above: S) -> S {
    let twice = curvature * distance2 + above * 2.0;
    twice * ((curvature * twice + 1.0).sqrt() + 1.0).recip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::Jet;

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
                    local.distances::<f64>().distance(&point),
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
                let [one, other] = [&local, &turned].map(|l| l.distances::<f64>().distance(&point));
                assert!((one + other).abs() < 1e-9, "{local:?}: {one} {other}");
            }
            assert_eq!(turned.turned().numbers, local.numbers);
        }
    }

    #[test]
    fn derivatives_are_those_of_a_small_step() {
        const STEP: f64 = 1e-6;
        for local in all() {
            for point in points() {
                let jet = local.distances::<Jet>().distance(&point);
                assert_eq!(jet.value, local.distances::<f64>().distance(&point));
                for &k in local.free() {
                    let moved = |by: f64| {
                        let mut step = [0.0; MOST_FREE];
                        step[k] = by;
                        local.moved(&step).distances::<f64>().distance(&point)
                    };
                    let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                    let off = (slope - jet.by[k]).abs();
                    assert!(
                        off < 1e-5 * (1.0 + slope.abs()),
                        "{local:?} {k}: {slope} {}",
                        jet.by[k]
                    );
                }
            }
        }
    }
}
