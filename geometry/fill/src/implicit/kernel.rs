//! Radial basis functions.

use glam::DVec3;

/// A radial basis function, with the polynomial that goes with it.
///
/// Each is conditionally positive definite in space of an order that the polynomial covers, so that
/// interpolation has one answer wherever points determine the polynomial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// `r^2 log r` and a linear polynomial: Yoo, equation 2. Once differentiable at its centres in space.
    ThinPlate,
    /// `-r` and a linear polynomial, the least bending in space; not differentiable at its centres.
    Biharmonic,
    /// `r^3` and a quadratic polynomial: twice differentiable.
    Triharmonic,
    /// `-r^5` and a quadratic polynomial: four times differentiable. Whatever is a quadric comes out as it is.
    Quintic,
}

/// What a radial function is at a distance r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Radial {
    /// The function itself.
    pub(crate) value: f64,
    /// Its derivative over r: times the arm, the gradient.
    pub(crate) slope: f64,
    /// The derivative of `slope` over r: times the arm's square, what the second derivative has beside
    /// `slope` times the identity.
    pub(crate) bend: f64,
}

impl Kernel {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::ThinPlate,
        Self::Biharmonic,
        Self::Triharmonic,
        Self::Quintic,
    ];

    /// Degree of the polynomial.
    #[must_use]
    pub fn degree(self) -> usize {
        match self {
            Self::ThinPlate | Self::Biharmonic => 1,
            Self::Triharmonic | Self::Quintic => 2,
        }
    }

    /// Whether second derivatives at its centres are bounded, so that slopes can be conditions.
    #[must_use]
    pub fn takes_slopes(self) -> bool {
        matches!(self, Self::Triharmonic | Self::Quintic)
    }

    /// At a squared distance.
    #[inline]
    pub(crate) fn at(self, squared: f64) -> Radial {
        let r = squared.sqrt();
        match self {
            Self::ThinPlate if squared > 0.0 => {
                let log = 0.5 * libm::log(squared);
                Radial {
                    value: squared * log,
                    slope: 2.0 * log + 1.0,
                    bend: 2.0 / squared,
                }
            }
            Self::Biharmonic if squared > 0.0 => Radial {
                value: -r,
                slope: -1.0 / r,
                bend: 1.0 / (squared * r),
            },
            // At a centre, where gradients are taken as zero: they are bounded, and have no direction.
            Self::ThinPlate | Self::Biharmonic => Radial {
                value: 0.0,
                slope: 0.0,
                bend: 0.0,
            },
            Self::Triharmonic => Radial {
                value: squared * r,
                slope: 3.0 * r,
                bend: if r > 0.0 { 3.0 / r } else { 0.0 },
            },
            Self::Quintic => Radial {
                value: -squared * squared * r,
                slope: -5.0 * squared * r,
                bend: -15.0 * r,
            },
        }
    }
}

/// Terms of a polynomial of a degree up to 2.
pub(crate) fn terms(degree: usize) -> usize {
    if degree >= 2 { 10 } else { 4 }
}

/// The terms at a place, or their derivatives along a direction.
pub(crate) fn polynomial(at: DVec3, along: Option<DVec3>, out: &mut [f64]) {
    let DVec3 { x, y, z } = at;
    let all = match along {
        None => [1.0, x, y, z, x * x, y * y, z * z, y * z, z * x, x * y],
        Some(d) => [
            0.0,
            d.x,
            d.y,
            d.z,
            2.0 * x * d.x,
            2.0 * y * d.y,
            2.0 * z * d.z,
            y * d.z + z * d.y,
            z * d.x + x * d.z,
            x * d.y + y * d.x,
        ],
    };
    let length = out.len();
    out.copy_from_slice(&all[..length]);
}

/// A polynomial with these coefficients at a place, with its gradient.
pub(crate) fn evaluated(coefficients: &[f64], at: DVec3) -> (f64, DVec3) {
    let DVec3 { x, y, z } = at;
    let c = |k: usize| coefficients.get(k).copied().unwrap_or(0.0);
    let value = c(0)
        + c(1) * x
        + c(2) * y
        + c(3) * z
        + c(4) * x * x
        + c(5) * y * y
        + c(6) * z * z
        + c(7) * y * z
        + c(8) * z * x
        + c(9) * x * y;
    let gradient = DVec3::new(
        c(1) + 2.0 * c(4) * x + c(8) * z + c(9) * y,
        c(2) + 2.0 * c(5) * y + c(7) * z + c(9) * x,
        c(3) + 2.0 * c(6) * z + c(7) * y + c(8) * x,
    );
    (value, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms() {
        let at = |kernel: Kernel, r: f64| kernel.at(r * r).value;
        assert!((at(Kernel::ThinPlate, 2.0) - 4.0 * libm::log(2.0)).abs() < 1e-12);
        assert_eq!(at(Kernel::Biharmonic, 2.0), -2.0);
        assert_eq!(at(Kernel::Triharmonic, 2.0), 8.0);
        assert_eq!(at(Kernel::Quintic, 2.0), -32.0);
        for kernel in Kernel::ALL {
            assert_eq!(at(kernel, 0.0), 0.0, "{kernel:?}");
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        let step = 1e-5;
        for kernel in Kernel::ALL {
            for r in [0.1, 0.7, 1.0, 3.0] {
                let value = |r: f64| kernel.at(r * r).value;
                let slope = |r: f64| kernel.at(r * r).slope;
                let own = kernel.at(r * r);
                let by_values = (value(r + step) - value(r - step)) / (2.0 * step);
                let by_slopes = (slope(r + step) - slope(r - step)) / (2.0 * step);
                let scale = 1.0 + by_values.abs() + by_slopes.abs();
                assert!(
                    (own.slope * r - by_values).abs() < 1e-7 * scale,
                    "{kernel:?} {r}"
                );
                assert!(
                    (own.bend * r - by_slopes).abs() < 1e-7 * scale,
                    "{kernel:?} {r}"
                );
            }
        }
    }

    #[test]
    fn polynomials_and_their_slopes() {
        let (at, along) = (DVec3::new(0.3, -1.2, 2.0), DVec3::new(0.2, 0.5, -0.7));
        let coefficients: Vec<f64> = (1..=10).map(f64::from).collect();
        let mut row = [0.0; 10];
        let dot = |row: &[f64]| {
            row.iter()
                .zip(&coefficients)
                .map(|(a, b)| a * b)
                .sum::<f64>()
        };
        polynomial(at, None, &mut row);
        let (value, gradient) = evaluated(&coefficients, at);
        assert!((dot(&row) - value).abs() < 1e-12);
        polynomial(at, Some(along), &mut row);
        assert!((dot(&row) - gradient.dot(along)).abs() < 1e-12);
        let step = 1e-6;
        let ahead = evaluated(&coefficients, at + step * along).0;
        let behind = evaluated(&coefficients, at - step * along).0;
        assert!(((ahead - behind) / (2.0 * step) - gradient.dot(along)).abs() < 1e-7);
    }
}
