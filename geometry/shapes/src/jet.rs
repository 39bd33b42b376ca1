//! Numbers that carry their derivatives (forward automatic differentiation).

use core::ops::{Add, Mul, Neg, Sub};

/// Numbers that a shape may have free, at most: those of a torus.
pub(crate) const MOST_FREE: usize = 7;

/// A value and its derivatives by the free numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) by: [f64; MOST_FREE],
}

/// What shapes are computed with: plain numbers, or numbers that carry derivatives.
pub(crate) trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Add<f64, Output = Self>
{
    /// A value that does not vary.
    fn constant(value: f64) -> Self {
        Self::varying(value, [])
    }
    /// A value with its derivatives by some free numbers.
    fn varying<const N: usize>(value: f64, by: [(usize, f64); N]) -> Self;
    /// The plain number.
    fn value(self) -> f64;
    fn sqrt(self) -> Self;
    fn recip(self) -> Self;
    fn sin_cos(self) -> (Self, Self);

    /// The free number of this index itself.
    fn free(value: f64, index: usize) -> Self {
        Self::varying(value, [(index, 1.0)])
    }
}

impl Scalar for f64 {
    fn varying<const N: usize>(value: f64, _by: [(usize, f64); N]) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        self.max(Self::MIN_POSITIVE).sqrt()
    }

    fn recip(self) -> Self {
        1.0 / self
    }

    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
}

impl Jet {
    /// A function of this, from its value and its derivative here.
    fn chained(self, value: f64, slope: f64) -> Self {
        let mut by = self.by;
        for by in &mut by {
            *by *= slope;
        }
        Self { value, by }
    }

    /// With the derivatives of another, times a factor, added to its own.
    fn with(mut self, value: f64, factor: f64, other: &Self) -> Self {
        for (by, other) in self.by.iter_mut().zip(&other.by) {
            *by += factor * other;
        }
        self.value = value;
        self
    }
}

impl Scalar for Jet {
    fn varying<const N: usize>(value: f64, by: [(usize, f64); N]) -> Self {
        let mut jet = Self {
            value,
            by: [0.0; MOST_FREE],
        };
        for (index, part) in by {
            jet.by[index] += part;
        }
        jet
    }

    fn value(self) -> f64 {
        self.value
    }

    fn sqrt(self) -> Self {
        let root = Scalar::sqrt(self.value);
        self.chained(root, 0.5 / root)
    }

    fn recip(self) -> Self {
        let recip = 1.0 / self.value;
        self.chained(recip, -recip * recip)
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.chained(sin, cos), self.chained(cos, -sin))
    }
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(self.value + other.value, 1.0, &other)
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.with(self.value - other.value, -1.0, &other)
    }
}

impl Neg for Jet {
    type Output = Self;

    fn neg(self) -> Self {
        self.chained(-self.value, -1.0)
    }
}

impl Mul for Jet {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        self.chained(value, other.value)
            .with(value, self.value, &other)
    }
}

impl Mul<f64> for Jet {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        self.chained(self.value * factor, factor)
    }
}

impl Add<f64> for Jet {
    type Output = Self;

    fn add(self, constant: f64) -> Self {
        Self {
            value: self.value + constant,
            by: self.by,
        }
    }
}
