//! The numbers of a face found, beside the true ones and the bound on their errors.

use nalgebra::Vector3;
use shapes::{Numbers, Shape};

use crate::bound::{Bound, Reading, bounds};
use crate::surface::{Parameter, TrueSurface};

/// A number found. Angles in degrees, lengths in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number {
    pub(crate) name: &'static str,
    pub(crate) error: f64,
    /// Its stated standard uncertainty.
    pub(crate) stated: f64,
    /// The least standard deviation that an unbiased estimate can have.
    pub(crate) bound: f64,
    /// The bound of the readings deep within the face alone; infinite where they leave the number
    /// open.
    pub(crate) inner_bound: f64,
    /// Error of an estimator that knows which readings are of this face.
    pub(crate) informed_error: f64,
}

impl Number {
    /// Whether the stated 95 % interval holds the truth.
    pub(crate) fn is_covered(&self) -> bool {
        self.error.abs() <= 1.96 * self.stated
    }
}

/// The numbers of a shape by the names that true surfaces have them by.
struct Told {
    place_mm: Vector3<f64>,
    direction: Option<Vector3<f64>>,
}

impl Told {
    fn of(shape: &Shape) -> Self {
        let told = |place_mm, direction| Self {
            place_mm,
            direction,
        };
        match shape {
            Shape::Plane(plane) => told(plane.point_mm, Some(plane.normal)),
            Shape::Sphere(sphere) => told(sphere.centre_mm, None),
            Shape::Cylinder(cylinder) => told(cylinder.point_mm, Some(cylinder.axis)),
            Shape::Cone(cone) => told(cone.apex_mm, Some(cone.axis)),
            Shape::Torus(torus) => told(torus.centre_mm, Some(torus.axis)),
        }
    }
}

/// Every number of a shape of the right family; `None` where the readings set no bound. `inner` are
/// those of the readings that lie deep within the face.
pub(crate) fn numbers(
    shape: &Shape,
    stated: &Numbers,
    real: &TrueSurface,
    readings: &[Reading],
    inner: &[Reading],
) -> Option<Vec<Number>> {
    if shape.family() != real.family {
        return None;
    }
    let told = Told::of(shape);
    // Where a plane or an axis is told is the fit's to choose.
    let real = real.told_beside(&told.place_mm);
    let all = bounds(&real, readings)?;
    let inner = bounds(&real, inner);
    let parameters = real.parameters();
    let each = parameters.iter().zip(all).enumerate();
    let numbers = each.filter_map(|(k, (parameter, bound))| {
        let inner = inner.as_ref().and_then(|inner| inner.get(k));
        let wider = inner.map_or(f64::INFINITY, |inner| inner.deviation / bound.deviation);
        let number = number(stated, &told, &real, parameter, bound)?;
        Some(Number {
            inner_bound: wider * number.bound,
            ..number
        })
    });
    Some(numbers.collect())
}

fn number(
    stated: &Numbers,
    told: &Told,
    real: &TrueSurface,
    parameter: &Parameter,
    bound: Bound,
) -> Option<Number> {
    let (name, error, stated, unit) = match parameter {
        Parameter::Lean(way) => {
            let found = told.direction?;
            // An axis has no sense.
            let found = found * found.dot(&real.direction).signum();
            let (along, off) = (found.dot(&real.direction), found.dot(way));
            let error = libm::atan2(off, along);
            let spread = stated.direction_rad?;
            (
                "direction, degrees",
                error,
                spread.along(way),
                1.0_f64.to_degrees(),
            )
        }
        Parameter::Shift(way) => {
            let error = (told.place_mm - real.place_mm).dot(way);
            ("position, mm", error, stated.place_mm.along(way), 1.0)
        }
        Parameter::Radius => {
            let found = stated.radius_mm?;
            let error = found.value - real.radius_mm;
            ("radius, mm", error, found.deviation, 1.0)
        }
        Parameter::Tube => {
            let found = stated.tube_mm?;
            let error = found.value - real.tube_mm;
            ("tube radius, mm", error, found.deviation, 1.0)
        }
        Parameter::HalfAngle => {
            let found = stated.half_angle_rad?;
            let error = found.value - real.half_angle_rad;
            (
                "half angle, degrees",
                error,
                found.deviation,
                1.0_f64.to_degrees(),
            )
        }
    };
    Some(Number {
        name,
        error: error * unit,
        stated: stated * unit,
        bound: bound.deviation * unit,
        inner_bound: f64::INFINITY,
        informed_error: bound.informed_error * unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::surface;
    use shapes::{Family, Sample, fit};

    /// Readings of the part of a surface around the middle of a field, each with noise of a fixed
    /// pattern.
    fn scanned(real: &TrueSurface, deviation_mm: f64) -> (Vec<Reading>, Vec<Sample>) {
        let places = (-20..=20).flat_map(|i| (-20..=20).map(move |j| (f64::from(i), f64::from(j))));
        let ray = -Vector3::z();
        let mut pairs = Vec::new();
        for (k, (x, y)) in places.enumerate() {
            let mut point = Vector3::new(0.5 * x, 0.5 * y, 25.0);
            for _ in 0..50 {
                let closing = real.normal(&point).z;
                point.z -= real.distance_mm(&point) / closing;
            }
            let chance = libm::sin(k as f64 * 12.9898) * 43758.5453;
            let noise = (chance - chance.floor() - 0.5) * 12.0_f64.sqrt() * deviation_mm;
            let reading = Reading {
                point_mm: point,
                told_mm: point - ray * noise,
                ray,
                deviation_mm,
            };
            let sample = Sample {
                point_mm: point - ray * noise,
                ray,
                sigma_mm: deviation_mm,
            };
            pairs.push((reading, sample));
        }
        pairs.into_iter().unzip()
    }

    #[test]
    fn a_good_fit_is_as_near_as_the_bound_and_says_so() {
        let mut ball = surface(Family::Sphere);
        ball.place_mm = Vector3::new(0.4, -0.3, 1.0);
        let (readings, samples) = scanned(&ball, 0.01);
        let fit = fit(Family::Sphere, &samples, 1.0).unwrap();
        let found = numbers(&fit.shape, &fit.numbers, &ball, &readings, &readings[..600]).unwrap();
        assert_eq!(found.len(), 4);
        for number in &found {
            assert!(number.inner_bound > number.bound);
            assert!(number.error.abs() < 4.0 * number.bound, "{number:?}");
            assert!(
                (number.stated / number.bound - 1.0).abs() < 0.2,
                "{number:?}"
            );
        }
        // The same numbers against a surface that is a little smaller.
        ball.radius_mm -= 1.0;
        let off = numbers(&fit.shape, &fit.numbers, &ball, &readings, &readings[..600]).unwrap();
        assert!((off[0].error - found[0].error - 1.0).abs() < 1e-9);
        assert!(!off[0].is_covered());
    }

    #[test]
    fn a_plane_that_leans_is_told_by_how_much() {
        let mut plane = surface(Family::Plane);
        let (readings, samples) = scanned(&plane, 0.01);
        let fit = fit(Family::Plane, &samples, 1.0).unwrap();
        let before = numbers(
            &fit.shape,
            &fit.numbers,
            &plane,
            &readings,
            &readings[..600],
        )
        .unwrap();
        let lean = plane.parameters()[0];
        plane = plane.moved(lean, 0.1_f64.to_radians());
        let after = numbers(
            &fit.shape,
            &fit.numbers,
            &plane,
            &readings,
            &readings[..600],
        )
        .unwrap();
        let leant = |n: &[Number]| libm::hypot(n[0].error, n[1].error);
        assert!(leant(&before) < 0.01);
        assert!((leant(&after) - 0.1).abs() < 0.01, "{after:?}");
        assert_eq!(
            numbers(
                &fit.shape,
                &fit.numbers,
                &surface(Family::Cone),
                &readings,
                &readings[..600]
            ),
            None
        );
    }
}
