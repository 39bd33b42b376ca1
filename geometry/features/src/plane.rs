//! Planes over samples, with their uncertainty.

use nalgebra::{Matrix3, Vector3};

/// A plane as heights over x and y, about the middle of its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The middle of the samples, millimetres.
    pub middle_mm: [f64; 2],
    /// Height there in millimetres, and slopes along x and y.
    pub values: Vector3<f64>,
    /// Covariance of `values` for noise as the samples show it.
    pub covariance: Matrix3<f64>,
    /// Root mean square of the samples that agree, about it, millimetres.
    pub rms_mm: f64,
    /// How many these are.
    pub samples: usize,
    /// Share of all samples that agree.
    pub share: f64,
}

impl Plane {
    /// Height at a place, millimetres.
    #[must_use]
    pub fn z_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        self.at(x_mm, y_mm).dot(&self.values)
    }

    /// Standard uncertainty of the height at a place, millimetres.
    #[must_use]
    pub fn sigma_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let at = self.at(x_mm, y_mm);
        ALIKE * (at.transpose() * self.covariance * at)[0].max(0.0).sqrt()
    }

    /// Unit normal, towards positive z.
    #[must_use]
    pub fn normal(&self) -> Vector3<f64> {
        Vector3::new(-self.values.y, -self.values.z, 1.0).normalize()
    }

    /// Rise over run.
    #[must_use]
    pub fn slope(&self) -> f64 {
        (self.values.y * self.values.y + self.values.z * self.values.z).sqrt()
    }

    /// Angle between the normal and another unit vector, radians.
    #[must_use]
    pub fn tilt_rad(&self, axis: &Vector3<f64>) -> f64 {
        libm::acos(self.normal().dot(axis).clamp(-1.0, 1.0))
    }

    fn at(&self, x_mm: f64, y_mm: f64) -> Vector3<f64> {
        Vector3::new(1.0, x_mm - self.middle_mm[0], y_mm - self.middle_mm[1])
    }
}

/// Neighbouring samples stray alike (speckle), so that a mean of many is less sure than of as many
/// that do not: by this factor on scans of parts with known levels, at most of the noises tried.
const ALIKE: f64 = 1.2;
/// Samples on a line, or nearly so, span no plane: the product of their spreads along and across it is
/// at most this share of the square of their sum.
const THIN: f64 = 1e-4;
/// Rounds of leaving out what strays.
const ROUNDS: usize = 4;
/// Samples further off than so many deviations are left out.
const DEVIATIONS: f64 = 3.5;
/// The median of |x| of a normal distribution, in its deviations.
const OF_MEDIAN: f64 = 0.674_489_750_196_082;

/// Plane through samples (x, y, z), least squares without what strays: the maximum likelihood of
/// normal noise (Bolle & Cooper 1986) but for outliers. `None` where they span none.
#[must_use]
pub fn plane(samples: &[[f64; 3]], noise_mm: f64) -> Option<Plane> {
    let mut within = f64::INFINITY;
    let mut found = None;
    for _ in 0..ROUNDS {
        let fitted = least_squares(samples, found.as_ref(), within, noise_mm)?;
        let mut off: Vec<f64> = samples
            .iter()
            .map(|[x, y, z]| (z - fitted.z_mm(*x, *y)).abs())
            .collect();
        let deviation = crate::field::median(&mut off)? / OF_MEDIAN;
        within = DEVIATIONS * deviation.max(noise_mm).max(1e-9);
        found = Some(fitted);
    }
    found
}

fn least_squares(
    samples: &[[f64; 3]],
    before: Option<&Plane>,
    within_mm: f64,
    noise_mm: f64,
) -> Option<Plane> {
    let agrees =
        |s: &&[f64; 3]| before.is_none_or(|p| (s[2] - p.z_mm(s[0], s[1])).abs() <= within_mm);
    let kept: Vec<&[f64; 3]> = samples.iter().filter(agrees).collect();
    if kept.len() < 6 {
        return None;
    }
    let count = kept.len() as f64;
    let middle = [0, 1].map(|axis| kept.iter().map(|s| s[axis]).sum::<f64>() / count);
    let spread = |a: usize, b: usize| {
        let products = kept.iter().map(|s| (s[a] - middle[a]) * (s[b] - middle[b]));
        products.sum::<f64>() / count
    };
    let (along, across, both) = (spread(0, 0), spread(1, 1), spread(0, 1));
    let total = along + across;
    if along * across - both * both <= THIN * total * total {
        return None;
    }
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for s in &kept {
        let at = Vector3::new(1.0, s[0] - middle[0], s[1] - middle[1]);
        normal += at * at.transpose();
        right += at * s[2];
    }
    let inverse = normal.try_inverse()?;
    let mut fitted = Plane {
        middle_mm: middle,
        values: inverse * right,
        covariance: inverse,
        rms_mm: 0.0,
        samples: kept.len(),
        share: count / samples.len() as f64,
    };
    let squares: f64 = kept
        .iter()
        .map(|s| {
            let off = s[2] - fitted.z_mm(s[0], s[1]);
            off * off
        })
        .sum();
    fitted.rms_mm = (squares / (count - 3.0)).sqrt();
    let deviation = fitted.rms_mm.max(0.5 * noise_mm);
    fitted.covariance = inverse * (deviation * deviation);
    fitted
        .values
        .iter()
        .all(|v| v.is_finite())
        .then_some(fitted)
}

#[cfg(test)]
mod tests {
    use super::plane;

    #[test]
    fn outliers_do_not_move_a_plane() {
        let mut samples = Vec::new();
        for i in 0..20 {
            for j in 0..20 {
                let (x, y) = (f64::from(i), f64::from(j));
                let wrong = if (i * 7 + j * 3) % 11 == 0 { 9.0 } else { 0.0 };
                samples.push([x, y, 1.0 + 0.1 * x - 0.2 * y + wrong]);
            }
        }
        let found = plane(&samples, 0.01).unwrap();
        assert!((found.z_mm(0.0, 0.0) - 1.0).abs() < 1e-9);
        assert!((found.z_mm(10.0, 5.0) - 1.0).abs() < 1e-9);
        assert!((found.share - 0.91).abs() < 0.01);
    }

    #[test]
    fn samples_on_a_line_span_none() {
        for tilt in [0.0, 1e-9, 1e-3] {
            let line = |k: u32| [f64::from(k), 19.93 + tilt * f64::from(k % 2), -30.0];
            let samples: Vec<[f64; 3]> = (0..73).map(line).collect();
            assert_eq!(plane(&samples, 0.02), None);
        }
    }
}
