//! The bound of Cramer and Rao on how well the numbers of a face can be known.
//!
//! A sample tells how far the surface lies along its ray, with a noise of known deviation there.
//! With J the slopes of these distances by the numbers, each in its deviation, no unbiased
//! estimate has a smaller covariance than the inverse of the sum of J J^T. What is counted is
//! every reading of this face alone; which they are is known to the simulator only, so that an
//! estimator that has to find out can come near the bound, and not below.
//!
//! Whether the bound is right is shown by an estimator that is told: least squares over just these
//! readings, from the truth on, in one step.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::surface::{Parameter, TrueSurface};

/// A reading of one surface, with noise alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    /// The true point, millimetres.
    pub(crate) point_mm: Vector3<f64>,
    /// The point as it was told, millimetres.
    pub(crate) told_mm: Vector3<f64>,
    /// Unit direction of the beam.
    pub(crate) ray: Vector3<f64>,
    /// Standard deviation along the beam, millimetres.
    pub(crate) deviation_mm: f64,
}

/// Step of the derivatives, radians or millimetres.
const STEP: f64 = 1e-4;
/// Cosine of incidence that is taken at least.
const LEAST_COS: f64 = 1e-3;

/// Of a number of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bound {
    /// The least standard deviation that an unbiased estimate can have.
    pub(crate) deviation: f64,
    /// Error of the estimator that knows the readings.
    pub(crate) informed_error: f64,
}

/// The bound of each of the surface's parameters; `None` where the readings leave one of them
/// open.
pub(crate) fn bounds(surface: &TrueSurface, readings: &[Reading]) -> Option<Vec<Bound>> {
    let known = Known::of(surface, readings)?;
    let pairs = known.covariance.diagonal();
    let pairs = pairs.iter().zip(known.informed.iter());
    let bounds = pairs.map(|(variance, informed)| Bound {
        deviation: variance.sqrt(),
        informed_error: *informed,
    });
    Some(bounds.collect())
}

/// A surface, as well as its readings let it be known.
pub(crate) struct Known {
    surface: TrueSurface,
    /// The least covariance of its parameters.
    covariance: DMatrix<f64>,
    /// What the estimator that knows the readings has them off by.
    informed: DVector<f64>,
}

/// A surface with one of its parameters a step up, and a step down.
fn steps(surface: &TrueSurface) -> Vec<(TrueSurface, TrueSurface)> {
    let moved = |parameter: &Parameter, step| surface.moved(*parameter, step);
    let parameters = surface.parameters();
    parameters
        .iter()
        .map(|parameter| (moved(parameter, STEP), moved(parameter, -STEP)))
        .collect()
}

impl Known {
    /// `None` as for [`bounds`].
    pub(crate) fn of(surface: &TrueSurface, readings: &[Reading]) -> Option<Self> {
        let pairs = steps(surface);
        let count = pairs.len();
        if readings.len() < count {
            return None;
        }
        let mut information = DMatrix::zeros(count, count);
        let mut right = DVector::zeros(count);
        for reading in readings {
            let point_mm = &reading.point_mm;
            let cos = surface.normal(point_mm).dot(&reading.ray).abs();
            let weight = 1.0 / (cos.max(LEAST_COS) * reading.deviation_mm);
            let per = 0.5 / STEP * weight;
            let slopes = pairs
                .iter()
                .map(|(up, down)| (up.distance_mm(point_mm) - down.distance_mm(point_mm)) * per);
            let slopes = DVector::from_iterator(count, slopes);
            information.syger(1.0, &slopes, &slopes, 1.0);
            right -= slopes * (surface.distance_mm(&reading.told_mm) * weight);
        }
        information.fill_upper_triangle_with_lower_triangle();
        // Angles and lengths differ by orders of magnitude.
        let scale = information.diagonal().map(|own: f64| 1.0 / own.sqrt());
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let by_scale = |all: &DMatrix<f64>| {
            DMatrix::from_fn(count, count, |i, j| all[(i, j)] * scale[i] * scale[j])
        };
        let factors = by_scale(&information).cholesky()?;
        let step = factors.solve(&right.component_mul(&scale));
        let known = Self {
            surface: *surface,
            covariance: by_scale(&factors.inverse()),
            informed: step.component_mul(&scale),
        };
        let mut all = known.covariance.iter().chain(known.informed.iter());
        all.all(|own| own.is_finite()).then_some(known)
    }

    /// The least standard deviation of where the surface lies along its normal beside a point,
    /// millimetres.
    pub(crate) fn deviation_mm(&self, point_mm: &Vector3<f64>) -> f64 {
        let pairs = steps(&self.surface);
        let slopes = pairs
            .iter()
            .map(|(up, down)| (up.distance_mm(point_mm) - down.distance_mm(point_mm)) * 0.5 / STEP);
        let slopes = DVector::from_iterator(pairs.len(), slopes);
        slopes.dot(&(&self.covariance * &slopes)).sqrt()
    }

    pub(crate) fn normal(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        self.surface.normal(point_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapes::Family;

    fn surface(family: Family) -> TrueSurface {
        TrueSurface {
            family,
            place_mm: Vector3::zeros(),
            direction: Vector3::z(),
            radius_mm: 10.0,
            tube_mm: 0.0,
            half_angle_rad: 0.0,
        }
    }

    fn deviations(surface: &TrueSurface, readings: &[Reading]) -> Option<Vec<f64>> {
        let bounds = bounds(surface, readings)?;
        Some(bounds.iter().map(|bound| bound.deviation).collect())
    }

    fn reading(point_mm: Vector3<f64>) -> Reading {
        Reading {
            point_mm,
            told_mm: point_mm,
            ray: -Vector3::z(),
            deviation_mm: 0.05,
        }
    }

    /// The straight line through points is known in closed form.
    #[test]
    fn a_plane_is_known_as_well_as_regression_has_it() {
        let points = (-10..=10).flat_map(|x| (-5..=5).map(move |y| (f64::from(x), f64::from(y))));
        let readings: Vec<Reading> = points
            .map(|(x, y)| reading(Vector3::new(x, y, 0.0)))
            .collect();
        let count = readings.len() as f64;
        let found = deviations(&surface(Family::Plane), &readings).unwrap();
        let of_squares =
            |of: fn(&Reading) -> f64| -> f64 { readings.iter().map(|r| of(r) * of(r)).sum() };
        let mut leans = [
            0.05 / of_squares(|r| r.point_mm.x).sqrt(),
            0.05 / of_squares(|r| r.point_mm.y).sqrt(),
        ];
        leans.sort_by(f64::total_cmp);
        let mut found_leans = [found[0], found[1]];
        found_leans.sort_by(f64::total_cmp);
        for (found, exact) in found_leans.iter().zip(leans) {
            assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
        }
        assert!((found[2] / (0.05 / count.sqrt()) - 1.0).abs() < 1e-6);

        let known = Known::of(&surface(Family::Plane), &readings).unwrap();
        let at = |x: f64, y: f64| known.deviation_mm(&Vector3::new(x, y, 0.0));
        assert!((at(0.0, 0.0) / found[2] - 1.0).abs() < 1e-6);
        // By regression, in units of the deviation of a reading.
        let [of_x, of_y] = [of_squares(|r| r.point_mm.x), of_squares(|r| r.point_mm.y)];
        let exact = 0.05 * (1.0 / count + 225.0 / of_x + 49.0 / of_y).sqrt();
        assert!((at(15.0, -7.0) / exact - 1.0).abs() < 1e-6);
    }

    /// Noise along a beam that meets a plane at a slant says as much less of its offset.
    #[test]
    fn a_slant_makes_the_noise_along_the_normal_smaller() {
        let mut readings: Vec<Reading> = [
            (0.0, 0.0),
            (3.0, 1.0),
            (-2.0, 4.0),
            (1.0, -5.0),
            (-2.0, 0.0),
        ]
        .map(|(x, y)| reading(Vector3::new(x, y, 0.0)))
        .to_vec();
        let straight = deviations(&surface(Family::Plane), &readings).unwrap();
        for reading in &mut readings {
            reading.ray = Vector3::new(0.8, 0.0, -0.6);
        }
        let slanted = deviations(&surface(Family::Plane), &readings).unwrap();
        for (straight, slanted) in straight.iter().zip(&slanted) {
            assert!((slanted / straight - 0.6).abs() < 1e-6);
        }
    }

    /// Readings all around a circle: the variance of a radius is that of a mean, that of a centre
    /// twice as large.
    #[test]
    fn a_round_is_known_as_its_closed_form_has_it() {
        let readings: Vec<Reading> = (0..360)
            .flat_map(|k| [-4.0, 4.0].map(move |z| (f64::from(k).to_radians(), z)))
            .map(|(angle, z)| {
                let (y, x) = libm::sincos(angle);
                Reading {
                    point_mm: Vector3::new(10.0 * x, 10.0 * y, z),
                    told_mm: Vector3::new(10.0 * x, 10.0 * y, z),
                    ray: Vector3::new(-x, -y, 0.0),
                    deviation_mm: 0.05,
                }
            })
            .collect();
        let found = deviations(&surface(Family::Cylinder), &readings).unwrap();
        let mean = 0.05 / 720.0_f64.sqrt();
        assert!((found[0] / mean - 1.0).abs() < 1e-6, "{found:?}");
        for shift in &found[3..] {
            assert!((shift / (mean * 2.0_f64.sqrt()) - 1.0).abs() < 1e-6);
        }
        for lean in &found[1..3] {
            assert!((lean / (mean * 2.0_f64.sqrt() / 4.0) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_readings_leave_open_has_no_bound() {
        let on_a_line: Vec<Reading> = (0..50)
            .map(|k| reading(Vector3::new(f64::from(k), 0.0, 0.0)))
            .collect();
        assert_eq!(deviations(&surface(Family::Plane), &on_a_line), None);
        assert_eq!(deviations(&surface(Family::Plane), &on_a_line[..2]), None);
    }

    #[test]
    fn who_knows_the_readings_finds_what_they_were_told_of() {
        let mut ball = surface(Family::Sphere);
        let readings: Vec<Reading> = (-6..=6)
            .flat_map(|x| (-6..=6).map(move |y| (f64::from(x), f64::from(y))))
            .map(|(x, y)| {
                let z = |radius: f64| (radius * radius - x * x - y * y).sqrt();
                Reading {
                    told_mm: Vector3::new(x, y, z(10.01)),
                    ..reading(Vector3::new(x, y, z(10.0)))
                }
            })
            .collect();
        let found = bounds(&ball, &readings).unwrap();
        assert!((found[0].informed_error - 0.01).abs() < 1e-4, "{found:?}");
        for centre in &found[1..] {
            assert!(centre.informed_error.abs() < 1e-4, "{found:?}");
        }
        // The same from a surface that is right for what was told.
        ball.radius_mm = 10.01;
        let found = bounds(&ball, &readings).unwrap();
        assert!(found[0].informed_error.abs() < 1e-6);
    }
}
