//! Linear least squares that strays have little part in.

use nalgebra::{SMatrix, SVector};

/// Rounds of weighing.
const ROUNDS: usize = 8;
/// The median distance times this is where an equation weighs half.
const WIDE: f64 = 1.0;

/// Solves `terms . x = value` for many equations, each weighed by how far it is off
/// (Cauchy's weights). Returns the solution and the weights; `None` where it is not unique.
pub(crate) fn solve<const N: usize>(
    equations: &[(SVector<f64, N>, f64)],
) -> Option<(SVector<f64, N>, Vec<f64>)> {
    let mut weights = vec![1.0; equations.len()];
    let mut solution = SVector::<f64, N>::zeros();
    for _ in 0..ROUNDS {
        let mut matrix = SMatrix::<f64, N, N>::zeros();
        let mut right = SVector::<f64, N>::zeros();
        for ((terms, value), weight) in equations.iter().zip(&weights) {
            matrix += terms * terms.transpose() * *weight;
            right += terms * (value * weight);
        }
        solution = matrix.cholesky()?.solve(&right);
        let off = |(terms, value): &(SVector<f64, N>, f64)| value - terms.dot(&solution);
        let median = median_size(equations.iter().map(off))?;
        let wide = WIDE * median.max(f64::MIN_POSITIVE);
        for (weight, equation) in weights.iter_mut().zip(equations) {
            *weight = (1.0 + (off(equation) / wide).powi(2)).recip();
        }
    }
    Some((solution, weights))
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

#[cfg(test)]
mod tests {
    use super::*;

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
