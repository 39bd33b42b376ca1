//! Weighted least squares in a few terms.

/// Normal equations of N terms. Solutions in the first few terms come from the same sums, so
/// that models which contain each other can be compared.
#[derive(Debug, Clone)]
pub(crate) struct LeastSquares<const N: usize> {
    products: [[f64; N]; N],
    with_z: [f64; N],
    z_squared: f64,
    weight: f64,
}

/// The best fit in the first terms; the others are 0.
#[derive(Debug, Clone)]
pub(crate) struct Solution<const N: usize> {
    pub(crate) terms: [f64; N],
    /// Weighted square sum of what is left.
    pub(crate) error: f64,
    factor: [[f64; N]; N],
    count: usize,
}

impl<const N: usize> LeastSquares<N> {
    pub(crate) fn new() -> Self {
        Self {
            products: [[0.0; N]; N],
            with_z: [0.0; N],
            z_squared: 0.0,
            weight: 0.0,
        }
    }

    /// Whole rows, although nothing asks for what lies above the diagonal: lanes take them at once.
    #[inline(always)]
    pub(crate) fn add(&mut self, terms: &[f64; N], z: f64, weight: f64) {
        for i in 0..N {
            let t = weight * terms[i];
            for (sum, term) in self.products[i].iter_mut().zip(terms) {
                *sum += t * term;
            }
            self.with_z[i] += t * z;
        }
        self.z_squared += weight * z * z;
        self.weight += weight;
    }

    /// Sum of the weights.
    pub(crate) fn weight(&self) -> f64 {
        self.weight
    }

    /// The fit in the first `count` terms; `None` where the nodes do not tell them apart.
    pub(crate) fn solve(&self, count: usize) -> Option<Solution<N>> {
        let mut factor = [[0.0; N]; N];
        let mut terms = [0.0; N];
        let mut error = self.z_squared;
        for i in 0..count {
            for j in 0..=i {
                let mut sum = self.products[i][j];
                for (a, b) in factor[i].iter().zip(factor[j]).take(j) {
                    sum -= a * b;
                }
                if i == j {
                    // What is left of a term that the others already make up.
                    if sum <= 1e-9 * self.products[i][i] {
                        return None;
                    }
                    factor[i][i] = libm::sqrt(sum);
                } else {
                    factor[i][j] = sum / factor[j][j];
                }
            }
            let mut sum = self.with_z[i];
            for (factor, known) in factor[i].iter().zip(terms).take(i) {
                sum -= factor * known;
            }
            terms[i] = sum / factor[i][i];
            error -= terms[i] * terms[i];
        }
        for i in (0..count).rev() {
            let mut sum = terms[i];
            for (row, known) in factor.iter().zip(terms).take(count).skip(i + 1) {
                sum -= row[i] * known;
            }
            terms[i] = sum / factor[i][i];
        }
        Some(Solution {
            terms,
            error: error.max(0.0),
            factor,
            count,
        })
    }
}

impl<const N: usize> Solution<N> {
    /// Variance of a term for nodes of unit variance and weight.
    pub(crate) fn variance(&self, term: usize) -> f64 {
        let mut column = [0.0; N];
        let mut sum = 0.0;
        for i in term..self.count {
            let mut value = f64::from(u8::from(i == term));
            for (factor, known) in self.factor[i].iter().zip(column).take(i).skip(term) {
                value -= factor * known;
            }
            column[i] = value / self.factor[i][i];
            sum += column[i] * column[i];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_fits_and_variances_are_those_of_closed_forms() {
        // z = 2 + 3 x over x = -2..=2: means and slopes decouple.
        let mut sums = LeastSquares::<2>::new();
        for x in (-2..=2).map(f64::from) {
            sums.add(&[1.0, x], 2.0 + 3.0 * x, 1.0);
        }
        let mean = sums.solve(1).unwrap();
        assert!((mean.terms[0] - 2.0).abs() < 1e-12);
        assert!((mean.error - 90.0).abs() < 1e-12, "{}", mean.error);
        let line = sums.solve(2).unwrap();
        assert!((line.terms[1] - 3.0).abs() < 1e-12);
        assert!(line.error < 1e-9);
        assert!((line.variance(0) - 0.2).abs() < 1e-12);
        assert!((line.variance(1) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn terms_that_cannot_be_told_apart_give_nothing() {
        let mut sums = LeastSquares::<2>::new();
        for x in 0..9 {
            sums.add(&[f64::from(x), 2.0 * f64::from(x)], 1.0, 1.0);
        }
        assert!(sums.solve(2).is_none());
    }
}
