//! Numbers side by side. Without a word of what the processor has: the compiler finds its lanes
//! where this is inlined.

use core::array::from_fn;
use core::ops::{Add, AddAssign, Div, Mul, Sub};

/// How many there are.
pub(super) const LANES: usize = 8;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lanes(pub(super) [f64; LANES]);

impl Lanes {
    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(from_fn(|lane| of(self.0[lane], other.0[lane])))
    }

    /// The first of some numbers, as many as there are lanes.
    #[inline(always)]
    pub(super) fn of(values: &[f64]) -> Self {
        let values = &values[..LANES];
        Self(from_fn(|lane| values[lane]))
    }

    #[inline(always)]
    pub(super) fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    /// The greater of each and of nothing.
    #[inline(always)]
    pub(super) fn at_least_0(self) -> Self {
        self.with(Self::default(), f64::max)
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl Div for Lanes {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}
