//! Bicubic splines over equal spans that are halved where data ask for it.
//!
//! The basis functions are those of the infinite uniform knot vector (cardinal
//! B-splines), of which a rectangle sees three more than it has spans along each side.
//! All have the same shape, and each is the sum of five of half the width (the two-scale
//! relation), so that a spline is carried over to a finer grid without any loss.

mod design;
mod far;
mod fit;

pub use design::Lines;
pub use fit::Scores;

use crate::banded::{BandedMatrix, Singular};
use crate::fit::{Observation, thirds};
use crate::piecewise::{PatchSurface, PiecewiseError};

/// A side of the rectangle: equal spans, and which of their ends are knots in use.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    first: f64,
    last: f64,
    spans: usize,
    /// Whether the third derivative may jump at the start of span `k`; `spans + 1` in all.
    used: Vec<bool>,
}

/// One of the two parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The first.
    U,
    /// The second.
    V,
}

/// A bicubic spline with two continuous derivatives over a rectangle of equal spans.
#[derive(Debug, Clone, PartialEq)]
pub struct UniformSpline {
    u: Axis,
    v: Axis,
    /// `(u.spans + 3) * (v.spans + 3)`, v fastest.
    coefficients: Vec<f64>,
}

impl Axis {
    fn new((first, last): (f64, f64)) -> Self {
        Self {
            first,
            last,
            spans: 1,
            used: vec![true; 2],
        }
    }

    fn functions(&self) -> usize {
        self.spans + 3
    }

    fn span(&self) -> f64 {
        (self.last - self.first) / self.spans as f64
    }

    /// Index of the first of the four functions that do not vanish at `t`, and their values.
    fn basis(&self, t: f64) -> (usize, [f64; 4]) {
        let at = (t - self.first) / self.span();
        let span = (at.floor().max(0.0) as usize).min(self.spans - 1);
        let f = at - span as f64;
        let g = 1.0 - f;
        let (f2, g2) = (f * f, g * g);
        let values = [
            g * g2 / 6.0,
            (4.0 - 6.0 * f2 + 3.0 * f * f2) / 6.0,
            (4.0 - 6.0 * g2 + 3.0 * g * g2) / 6.0,
            f * f2 / 6.0,
        ];
        (span, values)
    }

    fn halved(&self) -> Self {
        let mut used = vec![false; 2 * self.spans + 1];
        for (k, &u) in self.used.iter().enumerate() {
            used[2 * k] = u;
        }
        Self {
            spans: 2 * self.spans,
            used,
            ..*self
        }
    }

    /// Notes that function `i` takes part: it has knots at the ends of its four spans.
    fn use_function(&mut self, i: usize) {
        let last = (i + 1).min(self.spans);
        for used in &mut self.used[i.saturating_sub(3)..=last] {
            *used = true;
        }
    }

    fn breaks(&self) -> Vec<f64> {
        let place = |k: usize| {
            if k == self.spans {
                self.last
            } else {
                self.first + (self.last - self.first) * k as f64 / self.spans as f64
            }
        };
        let used = self.used.iter().enumerate().filter(|(_, used)| **used);
        used.map(|(k, _)| place(k)).collect()
    }
}

/// Coefficients of a line of functions on spans of half the width.
fn halved(coarse: &[f64]) -> impl Iterator<Item = f64> {
    // Function 1 is centred on the first knot, which stays the first knot.
    (0..2 * coarse.len() - 3).map(|i| {
        let at = i.div_ceil(2);
        if i % 2 == 1 {
            (coarse[at - 1] + 6.0 * coarse[at] + coarse[at + 1]) / 8.0
        } else {
            0.5 * (coarse[at] + coarse[at + 1])
        }
    })
}

/// Legendre polynomials (up to a factor) of degree 0 to 3 over -1..=1.
fn legendre(x: f64) -> [f64; 4] {
    [1.0, x, x * x - 1.0 / 3.0, x * (x * x - 0.6)]
}

/// The coefficient of function `i` on a single span of the same polynomials over it.
fn legendre_coefficients(i: usize) -> [f64; 4] {
    // A power of t averages t^k over the function's weight: p, p^2 - 1/3, p^3 - p.
    let p = i as f64 - 1.0;
    let (square, cube) = (p * p - 1.0 / 3.0, p * p * p - p);
    [
        1.0,
        2.0 * p - 1.0,
        4.0 * square - 4.0 * p + 2.0 / 3.0,
        8.0 * cube - 12.0 * square + 4.8 * p - 0.4,
    ]
}

impl UniformSpline {
    /// The polynomial over the rectangle that fits the observations best, as a spline of
    /// one span: a sum of products of Legendre polynomials of the degrees given in
    /// `terms`, 0 to 3 in u and in v. `ridge` times the mean diagonal of the normal matrix
    /// holds back the terms above the first degree where data do not determine them.
    ///
    /// # Errors
    /// [`Singular`] when the observations do not determine the terms.
    ///
    /// # Panics
    /// When a degree is above 3.
    pub fn fit_polynomial(
        u_domain: (f64, f64),
        v_domain: (f64, f64),
        terms: &[(usize, usize)],
        observations: &[Observation],
        ridge: f64,
    ) -> Result<Self, Singular> {
        let (u, v) = (Axis::new(u_domain), Axis::new(v_domain));
        let count = terms.len();
        // Rows of the lower half.
        let mut products = vec![0.0; count * count];
        let mut solution = vec![0.0; count];
        let mut values = vec![0.0; count];
        let unit = |axis: &Axis, t: f64| 2.0 * (t - axis.first) / (axis.last - axis.first) - 1.0;
        for o in observations.iter().filter(|o| o.weight > 0.0) {
            let (a, b) = (legendre(unit(&u, o.u)), legendre(unit(&v, o.v)));
            for (value, &(p, q)) in values.iter_mut().zip(terms) {
                *value = a[p] * b[q];
            }
            let rows = products.chunks_exact_mut(count).zip(&mut solution);
            for (k, (row, right)) in rows.enumerate() {
                let weighted = o.weight * values[k];
                *right += weighted * o.value;
                for (sum, value) in row[..=k].iter_mut().zip(&values) {
                    *sum += weighted * value;
                }
            }
        }
        let mut matrix = BandedMatrix::zero(count, count);
        for (k, row) in products.chunks_exact(count).enumerate() {
            for (column, sum) in row[..=k].iter().enumerate() {
                matrix.add(k, column, *sum);
            }
        }
        let hold = ridge * matrix.trace() / terms.len() as f64;
        for (k, &(p, q)) in terms.iter().enumerate() {
            if p + q > 1 {
                matrix.add(k, k, hold);
            }
        }
        matrix.cholesky()?.solve(&mut solution);
        let mut coefficients = vec![0.0; 16];
        for (i, line) in coefficients.chunks_exact_mut(4).enumerate() {
            let a = legendre_coefficients(i);
            for (j, c) in line.iter_mut().enumerate() {
                let b = legendre_coefficients(j);
                let terms = terms.iter().zip(&solution);
                *c = terms.map(|(&(p, q), s)| s * a[p] * b[q]).sum();
            }
        }
        Ok(Self { u, v, coefficients })
    }

    /// The same function with spans of half the width along one parameter.
    #[must_use]
    pub fn halved(&self, along: Parameter) -> Self {
        let rows = self.v.functions();
        match along {
            Parameter::V => {
                let lines = self.coefficients.chunks_exact(rows);
                Self {
                    u: self.u.clone(),
                    v: self.v.halved(),
                    coefficients: lines.flat_map(halved).collect(),
                }
            }
            Parameter::U => {
                let u = self.u.halved();
                let mut coefficients = vec![0.0; u.functions() * rows];
                let mut line = Vec::with_capacity(self.u.functions());
                for j in 0..rows {
                    line.clear();
                    line.extend(self.coefficients[j..].iter().step_by(rows));
                    for (i, c) in halved(&line).enumerate() {
                        coefficients[i * rows + j] = c;
                    }
                }
                Self {
                    u,
                    v: self.v.clone(),
                    coefficients,
                }
            }
        }
    }

    /// Width of a span along one parameter.
    #[must_use]
    pub fn span(&self, along: Parameter) -> f64 {
        match along {
            Parameter::U => self.u.span(),
            Parameter::V => self.v.span(),
        }
    }

    /// Numbers of basis functions in u and in v.
    #[must_use]
    pub fn functions(&self) -> (usize, usize) {
        (self.u.functions(), self.v.functions())
    }

    /// The value at `(u, v)`; beyond the rectangle the outermost polynomials go on.
    #[must_use]
    pub fn value(&self, u: f64, v: f64) -> f64 {
        let (a, b) = (self.u.basis(u), self.v.basis(v));
        self.combine(&a, &b)
    }

    fn combine(&self, (i, a): &(usize, [f64; 4]), (j, b): &(usize, [f64; 4])) -> f64 {
        let rows = self.v.functions();
        let lines = self.coefficients[i * rows..].chunks(rows);
        let along = |line: &[f64]| -> f64 { line[*j..].iter().zip(b).map(|(c, b)| c * b).sum() };
        lines.zip(a).map(|(line, a)| a * along(line)).sum()
    }

    /// The spline as patches, one for each rectangle between knots in use.
    ///
    /// # Errors
    /// [`PiecewiseError`] when a coefficient is not finite.
    pub fn to_patches(&self) -> Result<PatchSurface, PiecewiseError> {
        let (u, v) = (self.u.breaks(), self.v.breaks());
        let bases = |axis: &Axis, breaks: &[f64]| -> Vec<(usize, [f64; 4])> {
            thirds(breaks).iter().map(|&t| axis.basis(t)).collect()
        };
        let (a, b) = (bases(&self.u, &u), bases(&self.v, &v));
        PatchSurface::through_thirds(u, v, |i, j| self.combine(&a[i], &b[j]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(usize, usize); 16] = {
        let mut all = [(0, 0); 16];
        let mut k = 0;
        while k < 16 {
            all[k] = (k / 4, k % 4);
            k += 1;
        }
        all
    };

    fn cubic(u: f64, v: f64) -> f64 {
        1.0 - u + 0.3 * v * v - 0.02 * u * u * u + 0.01 * u * v * v * v
    }

    fn spline() -> UniformSpline {
        let mut data = Vec::new();
        for i in 0..12 {
            for j in 0..9 {
                let (u, v) = (-2.0 + 0.5 * f64::from(i), 1.0 + 0.7 * f64::from(j));
                data.push(Observation {
                    u,
                    v,
                    value: cubic(u, v),
                    weight: 1.0,
                });
            }
        }
        UniformSpline::fit_polynomial((-3.0, 5.0), (0.5, 7.5), &ALL, &data, 0.0).unwrap()
    }

    #[test]
    fn bicubic_polynomials_are_met_and_kept_when_spans_are_halved() {
        let mut spline = spline();
        for along in [Parameter::U, Parameter::V, Parameter::V, Parameter::U] {
            for (u, v) in [(-2.9, 0.6), (0.1, 4.0), (4.9, 7.4), (5.0, 7.5)] {
                assert!((spline.value(u, v) - cubic(u, v)).abs() < 1e-10);
            }
            spline = spline.halved(along);
        }
        assert_eq!(spline.functions(), (7, 7));
        assert_eq!(spline.span(Parameter::U), 2.0);
    }

    #[test]
    fn halving_changes_no_spline() {
        let mut coarse = spline().halved(Parameter::U).halved(Parameter::V);
        for (k, c) in coarse.coefficients.iter_mut().enumerate() {
            *c = ((k * 7) % 11) as f64;
        }
        let fine = coarse.halved(Parameter::U).halved(Parameter::V);
        for k in 0..50 {
            let (u, v) = (
                -3.0 + 0.16 * f64::from(k),
                0.5 + 0.14 * f64::from(k * 17 % 50),
            );
            assert!((coarse.value(u, v) - fine.value(u, v)).abs() < 1e-12);
        }
    }

    #[test]
    fn knots_that_are_not_used_make_no_patches() {
        let spline = spline().halved(Parameter::U).halved(Parameter::U);
        let patches = spline.to_patches().unwrap();
        assert_eq!(patches.patches.len(), 1);
        assert!((patches.z(0.7, 3.0) - cubic(0.7, 3.0)).abs() < 1e-10);
        assert_eq!(patches.u_domain(), (-3.0, 5.0));
    }
}
