//! Linear least squares that strays have little part in.

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use crate::spread::spread;

/// Scatter below this share of what samples are said to have is not believed: where a scanner
/// counts in steps as wide as its noise, more than half of the samples of a small face may lie
/// on one step.
pub(crate) const LEAST_SCATTER: f64 = 0.3;
/// Rounds of weighing, at most, and those of them that see all equations.
const ROUNDS: usize = 8;
const ROUNDS_OF_ALL: usize = 2;
/// Most equations of the other rounds.
const SOME: usize = 2000;
/// Least share of its square that a term must have of its own, beside the terms before it: less is
/// rounding.
const UNIQUE: f64 = 1e-12;
/// The median distance times this is where an equation weighs half.
const WIDE: f64 = 1.0;

type Equation<const N: usize> = (SVector<f64, N>, f64);

/// Solves `terms . x = value` for many equations, each weighed by how far it is off
/// (Cauchy's weights). Returns the solution and the weights; `None` where it is not unique.
pub(crate) fn solve<const N: usize>(
    equations: &[Equation<N>],
) -> Option<(SVector<f64, N>, Vec<f64>)> {
    if equations.len() <= SOME {
        return weighed(equations, vec![1.0; equations.len()], ROUNDS);
    }
    let some: Vec<_> = spread(equations.len(), SOME)
        .map(|k| equations[k])
        .collect();
    let (solution, _) = weighed(&some, vec![1.0; some.len()], ROUNDS - ROUNDS_OF_ALL)?;
    let weights = weights(equations, &solution)?;
    weighed(equations, weights, ROUNDS_OF_ALL)
}

/// Solves for the equations that a solution nearby leaves within the bounds of noise, as
/// shapes are fitted.
pub(crate) fn least_squares<const N: usize>(
    equations: &[Equation<N>],
    near: &SVector<f64, N>,
) -> Option<SVector<f64, N>> {
    let off = |(terms, value): &Equation<N>| value - terms.dot(near);
    let held = held(equations.iter().map(off));
    weighed(equations, held, 1).map(|(solution, _)| solution)
}

/// Rounds of solving with weights, and weighing by the solution.
fn weighed<const N: usize>(
    equations: &[Equation<N>],
    mut by: Vec<f64>,
    rounds: usize,
) -> Option<(SVector<f64, N>, Vec<f64>)> {
    let mut solution = SVector::zeros();
    for _ in 0..rounds {
        let (matrix, right) = Arch::new().dispatch(Summed { equations, by: &by });
        let factors = matrix.cholesky()?;
        let is_unique = (0..N).all(|k| {
            let pivot = factors.l_dirty()[(k, k)];
            pivot * pivot > UNIQUE * matrix[(k, k)]
        });
        if !is_unique {
            return None;
        }
        solution = factors.solve(&right);
        by = weights(equations, &solution)?;
    }
    Some((solution, by))
}

/// Equations to be summed up with the lanes that the processor has.
struct Summed<'a, const N: usize> {
    equations: &'a [Equation<N>],
    /// What each weighs.
    by: &'a [f64],
}

impl<const N: usize> WithSimd for Summed<'_, N> {
    type Output = (SMatrix<f64, N, N>, SVector<f64, N>);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut matrix = [[0.0; N]; N];
        let mut right = [0.0; N];
        for ((terms, value), weight) in self.equations.iter().zip(self.by) {
            let terms: &[f64; N] = &terms.data.0[0];
            for (column, right) in right.iter_mut().enumerate() {
                let weighed = terms[column] * weight;
                *right += weighed * value;
                // Whole columns, although the lower half is all that the factors are made from: lanes
                // take them at once.
                for (sum, term) in matrix[column].iter_mut().zip(terms) {
                    *sum += weighed * term;
                }
            }
        }
        (SMatrix::from(matrix), SVector::from(right))
    }
}

/// What each equation weighs by how far it is off. `None` where there are none.
fn weights<const N: usize>(
    equations: &[Equation<N>],
    solution: &SVector<f64, N>,
) -> Option<Vec<f64>> {
    let off = |(terms, value): &Equation<N>| value - terms.dot(solution);
    let wide = WIDE * median_size(equations.iter().map(off))?.max(f64::MIN_POSITIVE);
    let weight = |equation| (1.0 + (off(equation) / wide).powi(2)).recip();
    Some(equations.iter().map(weight).collect())
}

/// The median of the numbers' sizes; `None` where there are none.
pub(crate) fn median_size(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    let middle = sizes.len() / 2;
    (!sizes.is_empty()).then(|| *sizes.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The standard deviation of normal numbers, by the median of their sizes; infinite where there
/// are none.
pub(crate) fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    /// Median of the sizes of normal numbers to their standard deviation.
    const OF_MEDIAN: f64 = 1.4826;
    median_size(values).map_or(f64::INFINITY, |median| OF_MEDIAN * median)
}

/// What is held of distances in deviations of their samples, as weights 0 and 1: all but what
/// is too far off to be noise.
pub(crate) fn held(off: impl Iterator<Item = f64>) -> Vec<f64> {
    /// Distances are held up to so many times their standard deviation.
    const HELD: f64 = 4.0;
    let off: Vec<f64> = off.collect();
    let most = HELD * deviation(off.iter().copied()).max(LEAST_SCATTER);
    let held = off.iter().map(|off| f64::from(u8::from(off.abs() <= most)));
    held.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_that_depend_on_each_other_but_for_rounding_solve_nothing() {
        // Of what lies in two rows, the square of the row is no more than a line.
        let solved = |rows: u32, first: f64| {
            let equation = |k: u32| {
                let (u, v) = (f64::from(k) / 300.0, f64::from(k % rows) * 0.01 + first);
                let noise = 0.001 * f64::from(k * 7919 % 13);
                (
                    SVector::from([1.0, u, v, 2.0 * u * u - 1.0, u * v, 2.0 * v * v - 1.0]),
                    0.4 * u + noise,
                )
            };
            let equations: Vec<_> = (0..300).map(equation).collect();
            weighed(&equations, vec![1.0; 300], 1).map(|(solution, _)| solution)
        };
        for k in 0..50 {
            let first = 0.001 * f64::from(k);
            assert_eq!(solved(2, first), None);
            let plane = solved(3, first).expect("three rows tell a bend");
            assert!((plane[1] - 0.4).abs() < 0.02, "{plane}");
        }
    }

    #[test]
    fn a_third_of_strays_leaves_the_line() {
        let equations: Vec<_> = (0..60)
            .map(|k| {
                let x = f64::from(k) / 60.0;
                let stray = if k % 3 == 0 { 5.0 + x } else { 0.0 };
                (SVector::from([1.0, x]), 2.0 - 0.5 * x + stray)
            })
            .collect();
        let (line, weights) = solve(&equations).expect("two unknowns");
        assert!(
            (line[0] - 2.0).abs() < 0.01 && (line[1] + 0.5).abs() < 0.01,
            "{line}"
        );
        let strays = weights.iter().step_by(3).copied().fold(0.0, f64::max);
        let all: f64 = weights.iter().sum();
        assert!(strays < 1e-3 && all > 0.4 * 40.0, "{strays} {all}");
        assert!(solve(&equations[..1]).is_none());
    }
}
