//! Small symmetric systems.

/// Solves `matrix * x = right` for a symmetric positive definite matrix, of which the lower
/// triangle is read. `None` where it is singular, or so near to it that a pivot loses all
/// but a millionth millionth of its entry.
pub(crate) fn solve<const N: usize>(
    mut matrix: [[f64; N]; N],
    mut right: [f64; N],
) -> Option<[f64; N]> {
    const LEAST_PIVOT: f64 = 1e-12;
    let diagonal: [f64; N] = core::array::from_fn(|k| matrix[k][k]);
    // Cholesky's factor takes the place of the lower triangle.
    for k in 0..N {
        for row in k..N {
            let mut sum = matrix[row][k];
            let (own, pivot) = (matrix[row], matrix[k]);
            for (a, b) in own.iter().zip(&pivot).take(k) {
                sum -= a * b;
            }
            if row == k {
                if sum.is_nan() || sum <= LEAST_PIVOT * diagonal[k] {
                    return None;
                }
                matrix[k][k] = sum.sqrt();
            } else {
                matrix[row][k] = sum / matrix[k][k];
            }
        }
    }
    for k in 0..N {
        for before in 0..k {
            right[k] -= matrix[k][before] * right[before];
        }
        right[k] /= matrix[k][k];
    }
    for k in (0..N).rev() {
        for after in k + 1..N {
            right[k] -= matrix[after][k] * right[after];
        }
        right[k] /= matrix[k][k];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_and_a_singular_one_refused() {
        let matrix = [[4.0, 0.0, 0.0], [2.0, 5.0, 0.0], [-1.0, 3.0, 9.0]];
        // Of x = (1, -2, 3), with the symmetric matrix.
        let x = solve(matrix, [-3.0, 1.0, 20.0]).unwrap();
        for (value, expected) in x.into_iter().zip([1.0, -2.0, 3.0]) {
            assert!((value - expected).abs() < 1e-14, "{x:?}");
        }
        assert_eq!(solve([[1.0, 0.0], [2.0, 4.0]], [1.0, 2.0]), None);
        assert_eq!(solve([[0.0]], [1.0]), None);
    }
}
