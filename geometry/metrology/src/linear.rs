//! Normal equations of some of the unknowns.

use nalgebra::{SMatrix, SVector};

use crate::deviations::{Deviation, UNKNOWNS};

pub(crate) type Matrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
pub(crate) type Vector = SVector<f64, UNKNOWNS>;

/// Which of the unknowns are looked for.
pub(crate) type Chosen = [bool; UNKNOWNS];

/// A standard uncertainty of more than this share of what is usual determines nothing.
const DETERMINED: f64 = 0.1;

/// The normal matrix in units of what is usual for each unknown.
fn scaled(matrix: &Matrix) -> Matrix {
    let usual = |index: usize| Deviation::ALL.get(index).map_or(1.0, |d| d.usual());
    Matrix::from_fn(|row, column| matrix[(row, column)] * usual(row) * usual(column))
}

/// The unknowns that are not chosen are tied to zero.
fn masked(mut matrix: Matrix, chosen: &Chosen) -> Matrix {
    for (index, &is_chosen) in chosen.iter().enumerate() {
        if !is_chosen {
            matrix.row_mut(index).fill(0.0);
            matrix.column_mut(index).fill(0.0);
            matrix[(index, index)] = 1.0;
        }
    }
    matrix
}

/// Covariance of the chosen in units of what is usual; `None` where they cannot be told apart.
fn covariance_scaled(matrix: &Matrix, chosen: &Chosen) -> Option<Matrix> {
    let factors = masked(scaled(matrix), chosen).cholesky()?;
    let mut covariance = factors.inverse();
    for (index, &is_chosen) in chosen.iter().enumerate() {
        if !is_chosen {
            covariance.row_mut(index).fill(0.0);
            covariance.column_mut(index).fill(0.0);
        }
    }
    covariance
        .iter()
        .all(|v| v.is_finite())
        .then_some(covariance)
}

/// Covariance of the chosen in their units, for residuals of deviation 1.
pub(crate) fn covariance(matrix: &Matrix, chosen: &Chosen) -> Option<Matrix> {
    let usual = |index: usize| Deviation::ALL.get(index).map_or(1.0, |d| d.usual());
    let scaled = covariance_scaled(matrix, chosen)?;
    Some(Matrix::from_fn(|row, column| {
        scaled[(row, column)] * usual(row) * usual(column)
    }))
}

/// Step of the chosen that the normal equations ask for; the others stay.
pub(crate) fn step(matrix: &Matrix, right: &Vector, chosen: &Chosen) -> Option<Vector> {
    Some(covariance(matrix, chosen)? * right)
}

/// The unknowns that can be determined together, by their importance: each is taken only if all
/// that were taken before it stay determined. `factor` is that of the covariance.
pub(crate) fn choose(matrix: &Matrix, factor: f64) -> Chosen {
    let mut chosen = [false; UNKNOWNS];
    for deviation in Deviation::BY_IMPORTANCE {
        let mut with = chosen;
        with[deviation.index()] = true;
        let told = covariance_scaled(matrix, &with).is_some_and(|covariance| {
            (0..UNKNOWNS).all(|k| covariance[(k, k)] * factor <= DETERMINED * DETERMINED)
        });
        if told {
            chosen = with;
        }
    }
    chosen
}

/// Singular values of the scaled derivatives of the residuals, descending: of all unknowns, or of
/// the chosen.
pub(crate) fn singular_values(matrix: &Matrix, chosen: Option<&Chosen>) -> Vec<f64> {
    let mut scaled = scaled(matrix);
    let mut count = UNKNOWNS;
    if let Some(chosen) = chosen {
        count = chosen.iter().filter(|c| **c).count();
        for (index, _) in chosen.iter().enumerate().filter(|(_, c)| !**c) {
            scaled.row_mut(index).fill(0.0);
            scaled.column_mut(index).fill(0.0);
        }
    }
    let mut values: Vec<f64> = scaled
        .symmetric_eigenvalues()
        .iter()
        .map(|&value| libm::sqrt(value.max(0.0)))
        .collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values.truncate(count);
    values
}
