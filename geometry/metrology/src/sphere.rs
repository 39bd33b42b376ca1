//! A sphere fitted to samples: distances along their rays, without those that stray.

use nalgebra::{Matrix4, Vector3, Vector4};

use crate::robust::{Spread, deviation, weight};
use crate::scan::{Placed, RawSample, Ray};

/// Samples whose ray meets the sphere at a greater angle to its normal are left out, degrees:
/// towards the rim, light is lost and mixed with that of what stands behind.
pub const INCIDENCE_MOST_DEG: f64 = 60.0;
/// Rounds of weighing and solving, at most.
const ROUNDS: usize = 40;
/// It is solved once nothing moves by more, millimetres.
const STILL_MM: f64 = 1e-10;
/// Fewest samples for a fit.
const FEWEST: usize = 12;
/// Smallest deviation that residuals are measured in, millimetres: exact samples have none.
const LEAST_MM: f64 = 1e-9;

/// A fitted sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereFit {
    /// Its centre, millimetres.
    pub centre_mm: [f64; 3],
    /// Its diameter, millimetres; as given where it was not fitted.
    pub diameter_mm: f64,
    /// Covariance of the centre and the radius, square millimetres; the radius's part is zero
    /// where it was given.
    pub covariance_mm2: [[f64; 4]; 4],
    /// Standard deviation of the samples' distances from it, by those that do not stray,
    /// millimetres.
    pub deviation_mm: f64,
    /// Samples that were looked at.
    pub samples: usize,
}

impl SphereFit {
    /// Standard uncertainty of the diameter, millimetres.
    #[must_use]
    pub fn diameter_uncertainty_mm(&self) -> f64 {
        2.0 * libm::sqrt(self.covariance_mm2[3][3].max(0.0))
    }

    /// Signed distance of a point from the surface, millimetres, positive outside.
    #[must_use]
    pub fn distance_mm(&self, point_mm: Vector3<f64>) -> f64 {
        (point_mm - Vector3::from(self.centre_mm)).norm() - self.diameter_mm / 2.0
    }
}

/// A sample on a sphere: where it is, millimetres, and the ray that brought it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighted {
    /// The sample in counts.
    pub raw: RawSample,
    /// The sample in the part frame, millimetres.
    pub point_mm: Vector3<f64>,
    /// Its ray.
    pub ray: Ray,
}

/// Fits a sphere to samples near where it is; its diameter, too, unless `fixed`.
///
/// Gauss-Newton steps on the distances from the tangent plane where each ray should have met the
/// sphere ([`Ray`]), with Tukey's weights, whose scale is the median size of the distances. `None`
/// where there are too few samples, or they do not tell it.
#[must_use]
pub fn fit(
    samples: &[Sighted],
    near_mm: Vector3<f64>,
    diameter_mm: f64,
    fixed: bool,
) -> Option<SphereFit> {
    if samples.len() < FEWEST {
        return None;
    }
    let mut centre = near_mm;
    let mut radius = diameter_mm / 2.0;
    let mut covariance = Matrix4::zeros();
    let mut scale = 0.0;
    for _ in 0..ROUNDS {
        let residuals: Vec<(f64, Vector3<f64>)> = samples
            .iter()
            .filter_map(|own| {
                let met = own.ray.meets(centre, radius)?;
                Some((met.off_mm(&own.ray, own.point_mm), met.normal))
            })
            .collect();
        if residuals.len() < FEWEST {
            return None;
        }
        scale = deviation(residuals.iter().map(|(off, _)| *off)).max(LEAST_MM);
        let mut matrix = Matrix4::zeros();
        let mut right = Vector4::zeros();
        let mut spread = Spread::default();
        for (off_mm, normal) in residuals {
            let off = off_mm / scale;
            spread.add(off);
            let weight = weight(off);
            let slope = Vector4::new(
                -normal.x,
                -normal.y,
                -normal.z,
                if fixed { 0.0 } else { -1.0 },
            ) / scale;
            matrix += slope * slope.transpose() * weight;
            right -= slope * (weight * off);
        }
        if fixed {
            matrix[(3, 3)] = 1.0;
        }
        let factors = matrix.cholesky()?;
        let step = factors.solve(&right);
        centre += step.xyz();
        radius += step.w;
        if !(radius > 0.0 && radius < 10.0 * diameter_mm && centre.norm().is_finite()) {
            return None;
        }
        covariance = factors.inverse() * spread.factor(if fixed { 3 } else { 4 });
        if fixed {
            covariance[(3, 3)] = 0.0;
        }
        if step.norm() < STILL_MM {
            break;
        }
    }
    let covariance_mm2 =
        core::array::from_fn(|row| core::array::from_fn(|column| covariance[(row, column)]));
    Some(SphereFit {
        centre_mm: centre.into(),
        diameter_mm: 2.0 * radius,
        covariance_mm2,
        deviation_mm: scale,
        samples: samples.len(),
    })
}

/// The samples whose rays meet a sphere at no more than [`INCIDENCE_MOST_DEG`].
///
/// They are chosen by their rays alone, so that no error of a range has a say in it; whatever a
/// ray brought back counts, be it from the sphere or not.
#[must_use]
pub fn cap(placed: &Placed, centre_mm: Vector3<f64>, diameter_mm: f64) -> Vec<Sighted> {
    let (sin, _) = libm::sincos(INCIDENCE_MOST_DEG * core::f64::consts::PI / 180.0);
    let reach_mm = diameter_mm / 2.0 * sin;
    let columns = placed.columns_within(centre_mm.x - reach_mm, centre_mm.x + reach_mm);
    let mut found = Vec::new();
    for column in columns {
        for &(raw, point_mm) in column {
            let ray = Ray::of(&placed.calibration, raw);
            if ray.passes_by_mm(centre_mm) <= reach_mm {
                found.push(Sighted { raw, point_mm, ray });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Draws;

    /// Samples of the side of a sphere that faces +z, by rays along -z, with noise of `noise_mm`
    /// along the radius.
    fn points(count: usize, noise_mm: f64, strays: f64) -> Vec<Sighted> {
        let mut draws = Draws::new(7);
        let mut normal = || (0..12).map(|_| draws.uniform()).sum::<f64>() - 6.0;
        let mut others = Draws::new(8);
        (0..count)
            .map(|_| {
                let (x, y) = loop {
                    let (x, y) = (2.0 * others.uniform() - 1.0, 2.0 * others.uniform() - 1.0);
                    if x * x + y * y < 0.75 {
                        break (x, y);
                    }
                };
                let way = Vector3::new(x, y, libm::sqrt(1.0 - x * x - y * y));
                let off = if others.uniform() < strays {
                    4.0 * others.uniform()
                } else {
                    noise_mm * normal()
                };
                let point_mm = Vector3::new(1.0, 2.0, 3.0 + off / way.z) + way * 12.7;
                let ray = Ray {
                    origin_mm: Vector3::new(point_mm.x, point_mm.y, 750.0),
                    along: -Vector3::z(),
                    count_mm: 1.0,
                };
                let raw = RawSample {
                    table_counts: 0,
                    lateral_counts: 0,
                    range_counts: 0,
                };
                Sighted { raw, point_mm, ray }
            })
            .collect()
    }

    #[test]
    fn exact_points_give_the_sphere() {
        let near = Vector3::new(1.5, 1.5, 2.0);
        let fit = fit(&points(500, 0.0, 0.0), near, 24.0, false).unwrap();
        assert!((fit.diameter_mm - 25.4).abs() < 1e-9, "{fit:?}");
        assert!((Vector3::from(fit.centre_mm) - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-9);
    }

    #[test]
    fn uncertainties_are_those_of_repeated_fits() {
        let all = points(200 * 400, 0.05, 0.0);
        let fits: Vec<_> = all
            .chunks(400)
            .map(|own| fit(own, Vector3::new(1.0, 2.0, 3.0), 25.4, false).unwrap())
            .collect();
        let rms = |off: &dyn Fn(&SphereFit) -> f64| {
            libm::sqrt(fits.iter().map(|f| off(f) * off(f)).sum::<f64>() / fits.len() as f64)
        };
        let mean = fits.iter().map(|f| f.diameter_mm - 25.4).sum::<f64>() / 200.0;
        let scattered = rms(&|f| f.diameter_mm - 25.4);
        assert!(
            mean.abs() < 0.25 * scattered,
            "biased by {mean} of {scattered}"
        );
        let told = rms(&|f| f.diameter_uncertainty_mm());
        assert!((scattered / told - 1.0).abs() < 0.15, "{scattered} {told}");
        let scattered = rms(&|f| f.centre_mm[1] - 2.0);
        let told = rms(&|f| libm::sqrt(f.covariance_mm2[1][1]));
        assert!((scattered / told - 1.0).abs() < 0.15, "{scattered} {told}");
        assert!((rms(&|f| f.deviation_mm) - 0.05).abs() < 0.003);
    }

    #[test]
    fn strays_on_one_side_do_not_draw_the_sphere_along() {
        let near = Vector3::new(1.0, 2.0, 3.0);
        let fit = fit(&points(4000, 0.05, 0.15), near, 25.4, false).unwrap();
        let off = fit.diameter_mm - 25.4;
        assert!(off.abs() < 4.0 * fit.diameter_uncertainty_mm(), "{fit:?}");
        assert!(fit.diameter_uncertainty_mm() < 0.03);
    }
}
