//! Scalar tensor-product splines and their least-squares fit.

use crate::banded::{BandedMatrix, Singular};
use crate::curve::ControlCountError;
use crate::knots::{Basis, KnotVector};
use crate::piecewise::{PatchSurface, PiecewiseError};

/// A scalar function of two parameters: B-splines in u times B-splines in v.
#[derive(Debug, Clone, PartialEq)]
pub struct TensorSpline {
    u_knots: KnotVector,
    v_knots: KnotVector,
    coefficients: Vec<f64>,
}

/// A measured value at `(u, v)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// First parameter.
    pub u: f64,
    /// Second parameter.
    pub v: f64,
    /// The value there.
    pub value: f64,
    /// How much its squared residual counts; not negative.
    pub weight: f64,
}

impl TensorSpline {
    /// A spline from knots and coefficients, v fastest.
    ///
    /// # Errors
    /// [`ControlCountError`] when their numbers do not match.
    pub fn new(
        u_knots: KnotVector,
        v_knots: KnotVector,
        coefficients: Vec<f64>,
    ) -> Result<Self, ControlCountError> {
        let needed = u_knots.control_count() * v_knots.control_count();
        let given = coefficients.len();
        if needed != given {
            return Err(ControlCountError { needed, given });
        }
        Ok(Self {
            u_knots,
            v_knots,
            coefficients,
        })
    }

    /// The knots in u.
    #[must_use]
    pub fn u_knots(&self) -> &KnotVector {
        &self.u_knots
    }

    /// The knots in v.
    #[must_use]
    pub fn v_knots(&self) -> &KnotVector {
        &self.v_knots
    }

    /// The coefficients, v fastest.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The value at `(u, v)`.
    #[must_use]
    pub fn value(&self, u: f64, v: f64) -> f64 {
        self.partial(u, v, 0, 0)
    }

    /// The partial derivative of order `u_order` in u and `v_order` in v.
    #[must_use]
    pub fn partial(&self, u: f64, v: f64, u_order: usize, v_order: usize) -> f64 {
        let a = self.u_knots.basis_derivative(u, u_order);
        let b = self.v_knots.basis_derivative(v, v_order);
        self.combine(&a, &b)
    }

    fn combine(&self, a: &Basis, b: &Basis) -> f64 {
        let rows = self.v_knots.control_count();
        let mut sum = 0.0;
        for i in 0..=self.u_knots.degree() {
            let mut inner = 0.0;
            for j in 0..=self.v_knots.degree() {
                inner += b.values[j] * self.coefficients[(a.first + i) * rows + b.first + j];
            }
            sum += a.values[i] * inner;
        }
        sum
    }

    /// Bicubic patches with one patch for each span, each through the 16 points that cut
    /// it in thirds. Up to degree 3 that is the spline itself, and joints are as smooth.
    ///
    /// # Errors
    /// [`PiecewiseError`] when a coefficient is not finite.
    pub fn to_patches(&self) -> Result<PatchSurface, PiecewiseError> {
        let (u, v) = (self.u_knots.breaks(), self.v_knots.breaks());
        let bases = |knots: &KnotVector, breaks: &[f64]| -> Vec<Basis> {
            thirds(breaks).iter().map(|&t| knots.basis(t)).collect()
        };
        let (a, b) = (bases(&self.u_knots, &u), bases(&self.v_knots, &v));
        PatchSurface::through_thirds(u, v, |i, j| self.combine(&a[i], &b[j]))
    }

    /// Least squares over a full rectangle of data: `value(i, j)` was seen at
    /// `(u[i], v[j])`. The normal equations separate into two banded ones.
    ///
    /// # Errors
    /// [`Singular`] when some basis function has too few data.
    pub fn fit_grid(
        u_knots: KnotVector,
        v_knots: KnotVector,
        u: &[f64],
        v: &[f64],
        value: impl Fn(usize, usize) -> f64,
    ) -> Result<Self, Singular> {
        let (columns, rows) = (u_knots.control_count(), v_knots.control_count());
        let bases = |knots: &KnotVector, at: &[f64]| -> Vec<Basis> {
            at.iter().map(|&t| knots.basis(t)).collect()
        };
        let (a, b) = (bases(&u_knots, u), bases(&v_knots, v));
        let v_system = gram(&b, v_knots.degree(), rows).cholesky()?;
        let u_system = gram(&a, u_knots.degree(), columns).cholesky()?;
        // Along v for each line of data, gathered at once into the right-hand sides of u.
        let mut coefficients = vec![0.0; columns * rows];
        let mut line = vec![0.0; rows];
        for (i, basis_u) in a.iter().enumerate() {
            line.fill(0.0);
            for (j, basis) in b.iter().enumerate() {
                let z = value(i, j);
                for k in 0..=v_knots.degree() {
                    line[basis.first + k] += basis.values[k] * z;
                }
            }
            v_system.solve(&mut line);
            for k in 0..=u_knots.degree() {
                let at = (basis_u.first + k) * rows;
                for (c, l) in coefficients[at..at + rows].iter_mut().zip(&line) {
                    *c += basis_u.values[k] * l;
                }
            }
        }
        let mut column = vec![0.0; columns];
        for j in 0..rows {
            for (i, c) in column.iter_mut().enumerate() {
                *c = coefficients[i * rows + j];
            }
            u_system.solve(&mut column);
            for (i, c) in column.iter().enumerate() {
                coefficients[i * rows + j] = *c;
            }
        }
        Ok(Self {
            u_knots,
            v_knots,
            coefficients,
        })
    }

    /// Least squares over scattered data with a penalty on the bending of the control
    /// net: `bending` times the mean diagonal of the normal matrix weighs the squared
    /// second differences of the coefficients in u and in v. A small value (1e-6 to
    /// 1e-3) carries the surface on in straight lines where there are no data; functions
    /// linear in u and in v are never bent.
    ///
    /// # Errors
    /// [`Singular`] when the data do not determine the spline: fewer than four places
    /// with weight, or all on a line.
    pub fn fit_scattered(
        u_knots: KnotVector,
        v_knots: KnotVector,
        observations: &[Observation],
        bending: f64,
    ) -> Result<Self, Singular> {
        let (columns, rows) = (u_knots.control_count(), v_knots.control_count());
        let (p, q) = (u_knots.degree(), v_knots.degree());
        let bandwidth = (p.max(2) * rows + q).max(2);
        let mut matrix = BandedMatrix::zero(columns * rows, bandwidth);
        let mut coefficients = vec![0.0; columns * rows];
        let mut terms: Vec<(usize, f64)> = Vec::with_capacity((p + 1) * (q + 1));
        // Observations of a grid come line by line, with one u for many.
        let mut line: Option<(f64, Basis)> = None;
        for observation in observations.iter().filter(|o| o.weight > 0.0) {
            let a = match line {
                Some((u, basis)) if u == observation.u => basis,
                _ => u_knots.basis(observation.u),
            };
            line = Some((observation.u, a));
            let b = v_knots.basis(observation.v);
            terms.clear();
            for i in 0..=p {
                for j in 0..=q {
                    let weight = a.values[i] * b.values[j];
                    terms.push(((a.first + i) * rows + b.first + j, weight));
                }
            }
            for (k, &(row, wr)) in terms.iter().enumerate() {
                let weighted = wr * observation.weight;
                coefficients[row] += weighted * observation.value;
                matrix.add_to_row(row, weighted, &terms[..=k]);
            }
        }
        let scale = bending * matrix.trace() / (columns * rows) as f64;
        for [before, here, after] in differences(&u_knots) {
            for j in 0..rows {
                let at = |(i, w): (usize, f64)| (i * rows + j, w);
                penalise(&mut matrix, scale, [at(before), at(here), at(after)]);
            }
        }
        for [before, here, after] in differences(&v_knots) {
            for i in 0..columns {
                let at = |(j, w): (usize, f64)| (i * rows + j, w);
                penalise(&mut matrix, scale, [at(before), at(here), at(after)]);
            }
        }
        matrix.cholesky()?.solve(&mut coefficients);
        Ok(Self {
            u_knots,
            v_knots,
            coefficients,
        })
    }
}

/// The places that cut each interval in thirds, ends included.
#[must_use]
pub fn thirds(breaks: &[f64]) -> Vec<f64> {
    let mut places = Vec::with_capacity(breaks.len() * 3);
    for pair in breaks.windows(2) {
        let third = (pair[1] - pair[0]) / 3.0;
        places.extend([pair[0], pair[0] + third, pair[0] + 2.0 * third]);
    }
    places.extend(breaks.last());
    places
}

fn gram(bases: &[Basis], degree: usize, size: usize) -> BandedMatrix {
    let mut matrix = BandedMatrix::zero(size, degree);
    for basis in bases {
        for i in 0..=degree {
            for j in 0..=i {
                let value = basis.values[i] * basis.values[j];
                if value != 0.0 {
                    matrix.add(basis.first + i, basis.first + j, value);
                }
            }
        }
    }
    matrix
}

/// Second differences over the Greville abscissae, scaled by their mean distance, as
/// index and factor of three coefficients each.
fn differences(knots: &KnotVector) -> Vec<[(usize, f64); 3]> {
    let count = knots.control_count();
    let (first, last) = knots.domain();
    let mean = (last - first) / (count - 1) as f64;
    (1..count.saturating_sub(1))
        .map(|i| {
            let before = mean / (knots.greville(i) - knots.greville(i - 1));
            let after = mean / (knots.greville(i + 1) - knots.greville(i));
            [(i - 1, before), (i, -before - after), (i + 1, after)]
        })
        .collect()
}

fn penalise(matrix: &mut BandedMatrix, scale: f64, terms: [(usize, f64); 3]) {
    for (k, &(row, wr)) in terms.iter().enumerate() {
        for &(column, wc) in &terms[..=k] {
            matrix.add(row, column, scale * wr * wc);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(first: f64, last: f64, count: usize) -> Vec<f64> {
        (0..count)
            .map(|k| first + (last - first) * k as f64 / (count - 1) as f64)
            .collect()
    }

    fn quadric(u: f64, v: f64) -> f64 {
        3.0 - 0.5 * u + 0.25 * v + 0.1 * u * u - 0.2 * u * v + 0.05 * u * u * v * v
    }

    #[test]
    fn a_grid_fit_reproduces_what_the_spline_can_express() {
        let (u, v) = (grid(-5.0, 5.0, 40), grid(0.0, 8.0, 33));
        let spline = TensorSpline::fit_grid(
            KnotVector::uniform(2, 25, -5.0, 5.0).unwrap(),
            KnotVector::uniform(2, 12, 0.0, 8.0).unwrap(),
            &u,
            &v,
            |i, j| quadric(u[i], v[j]),
        )
        .unwrap();
        let patches = spline.to_patches().unwrap();
        for (u, v) in [(-4.9, 0.3), (0.0, 4.0), (3.3, 7.7)] {
            assert!((spline.value(u, v) - quadric(u, v)).abs() < 1e-10);
            assert!((patches.z(u, v) - quadric(u, v)).abs() < 1e-10);
            let slope = -0.5 + 0.2 * u - 0.2 * v + 0.1 * u * v * v;
            assert!((spline.partial(u, v, 1, 0) - slope).abs() < 1e-9);
        }
    }

    #[test]
    fn a_grid_fit_is_the_least_squares_solution() {
        // The residual must be orthogonal to every basis function.
        let (u, v) = (grid(0.0, 1.0, 20), grid(0.0, 1.0, 15));
        let data = |i: usize, j: usize| ((i * 31 + j * 17) % 23) as f64;
        let knots = KnotVector::uniform(2, 4, 0.0, 1.0).unwrap();
        let spline = TensorSpline::fit_grid(knots.clone(), knots.clone(), &u, &v, data).unwrap();
        let mut projections = vec![0.0; spline.coefficients().len()];
        for (i, &u) in u.iter().enumerate() {
            for (j, &v) in v.iter().enumerate() {
                let residual = data(i, j) - spline.value(u, v);
                let (a, b) = (knots.basis(u), knots.basis(v));
                for k in 0..3 {
                    for l in 0..3 {
                        projections[(a.first + k) * 6 + b.first + l] +=
                            residual * a.values[k] * b.values[l];
                    }
                }
            }
        }
        assert!(projections.iter().all(|p| p.abs() < 1e-9));
    }

    #[test]
    fn too_few_data_are_an_error() {
        let knots = KnotVector::uniform(2, 10, 0.0, 1.0).unwrap();
        let few = grid(0.0, 1.0, 5);
        assert!(
            TensorSpline::fit_grid(knots.clone(), knots.clone(), &few, &few, |_, _| 1.0).is_err()
        );
        assert!(TensorSpline::fit_scattered(knots.clone(), knots, &[], 1e-4).is_err());
    }

    #[test]
    fn scattered_data_carry_a_plane_beyond_themselves() {
        let plane = |u: f64, v: f64| 2.0 + 0.7 * u - 1.3 * v;
        let knots = || KnotVector::uniform(2, 9, 0.0, 10.0).unwrap();
        // Data in a triangle only.
        let mut data = Vec::new();
        for i in 0..30 {
            for j in 0..30 - i {
                let (u, v) = (f64::from(i) / 3.0, f64::from(j) / 3.0);
                data.push(Observation {
                    u,
                    v,
                    value: plane(u, v),
                    weight: 1.0,
                });
            }
        }
        let spline = TensorSpline::fit_scattered(knots(), knots(), &data, 1e-4).unwrap();
        for (u, v) in [(1.0, 1.0), (10.0, 10.0), (0.0, 10.0), (9.0, 8.0)] {
            let error = spline.value(u, v) - plane(u, v);
            assert!(error.abs() < 1e-9, "{error} at {u}, {v}");
        }
    }

    #[test]
    fn weights_choose_between_contradicting_data() {
        let knots = || KnotVector::uniform(1, 1, 0.0, 1.0).unwrap();
        let mut data = Vec::new();
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            data.push(Observation {
                u,
                v,
                value: 1.0,
                weight: 3.0,
            });
            data.push(Observation {
                u,
                v,
                value: 5.0,
                weight: 1.0,
            });
        }
        let spline = TensorSpline::fit_scattered(knots(), knots(), &data, 0.0).unwrap();
        assert!((spline.value(0.3, 0.8) - 2.0).abs() < 1e-13);
    }
}
