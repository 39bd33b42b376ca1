//! Symmetric positive definite systems whose matrix is zero away from its diagonal.

/// A symmetric matrix with non-zero elements only near the diagonal; its lower half is
/// kept, row by row.
#[derive(Debug, Clone)]
pub struct BandedMatrix {
    size: usize,
    bandwidth: usize,
    lower: Vec<f64>,
}

/// The matrix is not positive definite: the unknown at this row is not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the data do not determine unknown {row} of the system")]
pub struct Singular {
    /// Row at which elimination stopped.
    pub row: usize,
}

/// Cholesky factor of a [`BandedMatrix`].
#[derive(Debug, Clone)]
pub struct BandedCholesky {
    factor: BandedMatrix,
}

impl BandedMatrix {
    /// The zero matrix with `bandwidth` diagonals below the main one.
    #[must_use]
    pub fn zero(size: usize, bandwidth: usize) -> Self {
        let bandwidth = bandwidth.min(size.saturating_sub(1));
        Self {
            size,
            bandwidth,
            lower: vec![0.0; size * (bandwidth + 1)],
        }
    }

    /// Adds to the element in this row and column of the lower half.
    ///
    /// # Panics
    /// When the element lies outside the band or above the diagonal.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        assert!(
            column <= row && row - column <= self.bandwidth,
            "element outside the lower band"
        );
        self.lower[row * (self.bandwidth + 1) + self.bandwidth + column - row] += value;
    }

    /// Adds `factor` times each value to the element in its column of one row.
    ///
    /// # Panics
    /// When an element lies outside the band or above the diagonal.
    pub fn add_to_row(&mut self, row: usize, factor: f64, elements: &[(usize, f64)]) {
        let w = self.bandwidth;
        let of_row = &mut self.lower[row * (w + 1)..(row + 1) * (w + 1)];
        for &(column, value) in elements {
            of_row[w + column - row] += factor * value;
        }
    }

    /// The element in this row and column of the lower band.
    fn get(&self, row: usize, column: usize) -> f64 {
        self.lower[row * (self.bandwidth + 1) + self.bandwidth + column - row]
    }

    /// The elements of a row inside the band and left of the diagonal.
    fn left_of_diagonal(&self, row: usize) -> &[f64] {
        let end = row * (self.bandwidth + 1) + self.bandwidth;
        &self.lower[end - self.bandwidth.min(row)..end]
    }

    /// Sum of the diagonal.
    #[must_use]
    pub fn trace(&self) -> f64 {
        (0..self.size).map(|i| self.get(i, i)).sum()
    }

    /// Factors the matrix in place.
    ///
    /// # Errors
    /// [`Singular`] when it is not positive definite.
    pub fn cholesky(mut self) -> Result<BandedCholesky, Singular> {
        let (w, stride) = (self.bandwidth, self.bandwidth + 1);
        for row in 0..self.size {
            let first = row.saturating_sub(w);
            let diagonal = self.get(row, row);
            for column in first..=row {
                let shared = first.max(column.saturating_sub(w));
                let of_row = &self.lower[row * stride + w + shared - row..][..column - shared];
                let of_column = &self.lower[column * stride + w + shared - column..];
                let dot: f64 = of_row.iter().zip(of_column).map(|(a, b)| a * b).sum();
                let rest = self.get(row, column) - dot;
                let value = if column < row {
                    rest / self.get(column, column)
                } else if rest > diagonal.abs() * 1e-13 {
                    rest.sqrt()
                } else {
                    return Err(Singular { row });
                };
                self.lower[row * stride + w + column - row] = value;
            }
        }
        Ok(BandedCholesky { factor: self })
    }
}

impl BandedCholesky {
    /// Solves the system for a right-hand side, in place.
    ///
    /// # Panics
    /// When its length is not the size of the matrix.
    pub fn solve(&self, rhs: &mut [f64]) {
        let l = &self.factor;
        assert_eq!(rhs.len(), l.size, "right-hand side of another size");
        for row in 0..l.size {
            let first = row.saturating_sub(l.bandwidth);
            let known = l.left_of_diagonal(row).iter().zip(&rhs[first..row]);
            let sum: f64 = known.map(|(a, x)| a * x).sum();
            rhs[row] = (rhs[row] - sum) / l.get(row, row);
        }
        for row in (0..l.size).rev() {
            let first = row.saturating_sub(l.bandwidth);
            let value = rhs[row] / l.get(row, row);
            rhs[row] = value;
            for (x, a) in rhs[first..row].iter_mut().zip(l.left_of_diagonal(row)) {
                *x -= a * value;
            }
        }
    }

    /// Solves the system for each coordinate of points.
    ///
    /// # Panics
    /// When there are not as many points as the matrix has rows.
    #[must_use]
    pub fn solve_points<const D: usize>(&self, sums: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut points = sums.to_vec();
        for d in 0..D {
            let mut column: Vec<f64> = sums.iter().map(|sum| sum[d]).collect();
            self.solve(&mut column);
            points
                .iter_mut()
                .zip(column)
                .for_each(|(point, value)| point[d] = value);
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_system_with_known_solution() {
        let (size, width) = (12, 3);
        let element = |i: usize, j: usize| {
            if i == j {
                10.0 + i as f64
            } else {
                1.0 / (1.0 + (i + 2 * j) as f64)
            }
        };
        let mut matrix = BandedMatrix::zero(size, width);
        let solution: Vec<f64> = (0..size).map(|i| (i as f64 - 5.5) * 0.3).collect();
        let mut rhs = vec![0.0; size];
        for i in 0..size {
            for j in i.saturating_sub(width)..=i {
                matrix.add(i, j, element(i, j));
                rhs[i] += element(i, j) * solution[j];
                if i != j {
                    rhs[j] += element(i, j) * solution[i];
                }
            }
        }
        matrix.cholesky().unwrap().solve(&mut rhs);
        for (a, b) in rhs.iter().zip(&solution) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn an_undetermined_unknown_is_named() {
        let mut matrix = BandedMatrix::zero(3, 1);
        for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 2)] {
            matrix.add(i, j, 1.0);
        }
        assert_eq!(matrix.cholesky().unwrap_err(), Singular { row: 1 });
    }
}
