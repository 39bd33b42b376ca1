//! Dense linear algebra: one order of operations, whatever the machine and the number of threads.

use rayon::prelude::*;

/// Rows from which on they are worth sharing out.
const SHARED_ROWS: usize = 256;

/// A square matrix by rows.
#[derive(Debug, Clone)]
pub(crate) struct Square {
    pub(crate) size: usize,
    pub(crate) values: Vec<f64>,
}

impl Square {
    pub(crate) fn zero(size: usize) -> Self {
        Self {
            size,
            values: vec![0.0; size * size],
        }
    }

    pub(crate) fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.size..(k + 1) * self.size]
    }
}

/// Four sums at a time, so that it goes through vector units in one order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours_a, fours_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = fours_a
        .remainder()
        .iter()
        .zip(fours_b.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in fours_a.zip(fours_b) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

fn add_scaled(to: &mut [f64], by: f64, what: &[f64]) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += by * what;
    }
}

/// Columns whose rest is smaller than this by their own length are no others than those before.
const DEPENDENT: f64 = 1e-7;

/// Reflections that bring a matrix's columns into upper triangular form, those first that add most;
/// columns that depend on others are left out.
#[derive(Debug, Clone)]
pub(crate) struct Reflections {
    /// Each with its factor: identity minus factor times v v', from the row of its number on.
    vectors: Vec<(Vec<f64>, f64)>,
    /// The triangle, by columns.
    triangle: Vec<Vec<f64>>,
    /// Which columns these are.
    kept: Vec<usize>,
    columns: usize,
}

/// The reflection that maps `x` onto its first axis: v, its factor, and what then stands there.
fn reflection(x: &[f64]) -> (Vec<f64>, f64, f64) {
    let mut v = x.to_vec();
    let rest = dot(&x[1..], &x[1..]);
    if rest == 0.0 {
        return (v, 0.0, x[0]);
    }
    let length = (x[0] * x[0] + rest).sqrt();
    let head = if x[0] > 0.0 { -length } else { length };
    v[0] -= head;
    let factor = 2.0 / (v[0] * v[0] + rest);
    (v, factor, head)
}

impl Reflections {
    /// Of columns of equal lengths.
    pub(crate) fn of(columns: Vec<Vec<f64>>) -> Self {
        let count = columns.len();
        let rows = columns.first().map_or(0, Vec::len);
        let longest = columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max);
        let least = longest * DEPENDENT * DEPENDENT;
        let mut left: Vec<(usize, Vec<f64>)> = columns.into_iter().enumerate().collect();
        let mut own = Self {
            vectors: Vec::new(),
            triangle: Vec::new(),
            kept: Vec::new(),
            columns: count,
        };
        while own.kept.len() < rows {
            let k = own.kept.len();
            let rest = |c: &(usize, Vec<f64>)| dot(&c.1[k..], &c.1[k..]);
            let best = (0..left.len()).max_by(|&a, &b| {
                rest(&left[a])
                    .total_cmp(&rest(&left[b]))
                    .then(left[b].0.cmp(&left[a].0))
            });
            let Some(best) = best.filter(|&best| rest(&left[best]) > least) else {
                break;
            };
            let (index, mut column) = left.swap_remove(best);
            let (v, factor, head) = reflection(&column[k..]);
            for (_, other) in &mut left {
                let by = factor * dot(&v, &other[k..]);
                add_scaled(&mut other[k..], -by, &v);
            }
            column[k] = head;
            own.triangle.push(column);
            own.vectors.push((v, factor));
            own.kept.push(index);
        }
        own
    }

    /// How many columns there are that do not depend on others.
    pub(crate) fn rank(&self) -> usize {
        self.kept.len()
    }

    /// Q' x.
    pub(crate) fn forward(&self, x: &mut [f64]) {
        for (first, (v, factor)) in self.vectors.iter().enumerate() {
            let by = factor * dot(v, &x[first..]);
            add_scaled(&mut x[first..], -by, v);
        }
    }

    /// Q x.
    pub(crate) fn back(&self, x: &mut [f64]) {
        for (first, (v, factor)) in self.vectors.iter().enumerate().rev() {
            let by = factor * dot(v, &x[first..]);
            add_scaled(&mut x[first..], -by, v);
        }
    }

    /// Q' A Q of a symmetric matrix, in place.
    pub(crate) fn both_sides(&self, matrix: &mut Square) {
        let size = matrix.size;
        matrix
            .values
            .par_chunks_mut(size)
            .with_min_len(SHARED_ROWS / 4)
            .for_each(|row| self.forward(row));
        // The same of the columns, a reflection at a time, so that memory is gone through by rows.
        for (first, (v, factor)) in self.vectors.iter().enumerate() {
            let mut sums = vec![0.0; size];
            for (k, by) in v.iter().enumerate() {
                add_scaled(&mut sums, *by, matrix.row(first + k));
            }
            for (k, by) in v.iter().enumerate() {
                let row = &mut matrix.values[(first + k) * size..(first + k + 1) * size];
                add_scaled(row, -factor * by, &sums);
            }
        }
    }

    /// x with R x = the head of `right`; zero for columns that were left out.
    pub(crate) fn solve_triangle(&self, right: &[f64]) -> Vec<f64> {
        let count = self.triangle.len();
        let mut x = right[..count].to_vec();
        for k in (0..count).rev() {
            for (other, column) in self.triangle.iter().enumerate().skip(k + 1) {
                x[k] -= column[k] * x[other];
            }
            x[k] /= self.triangle[k][k];
        }
        let mut out = vec![0.0; self.columns];
        for (&index, value) in self.kept.iter().zip(x) {
            out[index] = value;
        }
        out
    }
}

/// A symmetric matrix as Q T Q' with T of three diagonals.
#[derive(Debug, Clone)]
pub(crate) struct Tridiagonal {
    vectors: Vec<(Vec<f64>, f64)>,
    pub(crate) diagonal: Vec<f64>,
    pub(crate) beside: Vec<f64>,
}

impl Tridiagonal {
    /// By Householder's reflections.
    pub(crate) fn of(mut matrix: Square) -> Self {
        let size = matrix.size;
        let mut vectors = Vec::new();
        let (mut diagonal, mut beside) = (Vec::with_capacity(size), Vec::new());
        for k in 0..size {
            diagonal.push(matrix.values[k * size + k]);
            if k + 1 == size {
                break;
            }
            // Symmetric: the row is the column.
            let (v, factor, head) = reflection(&matrix.row(k)[k + 1..]);
            beside.push(head);
            let (_, below) = matrix.values.split_at_mut((k + 1) * size);
            let is_shared = v.len() > SHARED_ROWS;
            let product = |row: &[f64]| factor * dot(&row[k + 1..], &v);
            let mut w: Vec<f64> = if is_shared {
                below
                    .par_chunks(size)
                    .with_min_len(64)
                    .map(product)
                    .collect()
            } else {
                below.chunks(size).map(product).collect()
            };
            let half = 0.5 * factor * dot(&w, &v);
            add_scaled(&mut w, -half, &v);
            let update = |(row, (v_own, w_own)): (&mut [f64], (&f64, &f64))| {
                for ((own, v), w) in row[k + 1..].iter_mut().zip(&v).zip(&w) {
                    *own -= v_own * w + w_own * v;
                }
            };
            if is_shared {
                let rows = below.par_chunks_mut(size).with_min_len(64);
                rows.zip(v.par_iter().zip(w.par_iter())).for_each(update);
            } else {
                below
                    .chunks_mut(size)
                    .zip(v.iter().zip(&w))
                    .for_each(update);
            }
            vectors.push((v, factor));
        }
        Self {
            vectors,
            diagonal,
            beside,
        }
    }

    /// Q' x.
    pub(crate) fn forward(&self, x: &mut [f64]) {
        for (k, (v, factor)) in self.vectors.iter().enumerate() {
            let by = factor * dot(v, &x[k + 1..]);
            add_scaled(&mut x[k + 1..], -by, v);
        }
    }

    /// Q x.
    pub(crate) fn back(&self, x: &mut [f64]) {
        for (k, (v, factor)) in self.vectors.iter().enumerate().rev() {
            let by = factor * dot(v, &x[k + 1..]);
            add_scaled(&mut x[k + 1..], -by, v);
        }
    }

    /// `(T + ridge)^-1 right`, and the logarithm of the determinant; `None` where T + ridge is not positive.
    pub(crate) fn solve(&self, ridge: f64, right: &[f64]) -> Option<(Vec<f64>, f64)> {
        let size = self.diagonal.len();
        let mut x = right.to_vec();
        let mut pivots = Vec::with_capacity(size);
        let mut log = 0.0;
        for k in 0..size {
            let mut pivot = self.diagonal[k] + ridge;
            if k > 0 {
                let by = self.beside[k - 1] / pivots[k - 1];
                pivot -= by * self.beside[k - 1];
                x[k] -= by * x[k - 1];
            }
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            log += libm::log(pivot);
            pivots.push(pivot);
        }
        for k in (0..size).rev() {
            if k + 1 < size {
                x[k] -= self.beside[k] * x[k + 1];
            }
            x[k] /= pivots[k];
        }
        Some((x, log))
    }
}

/// Solves by elimination with the largest pivot of each column (Yoo, section 3.1); `None` where there
/// is none.
pub(crate) fn eliminate(mut matrix: Square, mut right: Vec<f64>) -> Option<Vec<f64>> {
    let size = matrix.size;
    let mut order: Vec<usize> = (0..size).collect();
    for k in 0..size {
        let at = |row: usize, matrix: &Square| matrix.values[row * size + k].abs();
        let best = (k..size).max_by(|&a, &b| {
            at(order[a], &matrix)
                .total_cmp(&at(order[b], &matrix))
                .then(b.cmp(&a))
        })?;
        order.swap(k, best);
        let pivot_row = matrix.row(order[k])[k..].to_vec();
        let pivot = pivot_row[0];
        if !(pivot.abs() > 0.0 && pivot.is_finite()) {
            return None;
        }
        let pivot_right = right[order[k]];
        let mut is_below = vec![false; size];
        order[k + 1..].iter().for_each(|&row| is_below[row] = true);
        let reduce = |(row, (right, below)): (&mut [f64], (&mut f64, &bool))| {
            let by = row[k] / pivot;
            if *below && by != 0.0 {
                add_scaled(&mut row[k..], -by, &pivot_row);
                *right -= by * pivot_right;
            }
        };
        let rows = matrix.values.par_chunks_mut(size).with_min_len(SHARED_ROWS);
        rows.zip(right.par_iter_mut().zip(is_below.par_iter()))
            .for_each(reduce);
    }
    let mut x = vec![0.0; size];
    for k in (0..size).rev() {
        let row = matrix.row(order[k]);
        x[k] = (right[order[k]] - dot(&row[k + 1..], &x[k + 1..])) / row[k];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(size: usize) -> Square {
        let mut matrix = Square::zero(size);
        for i in 0..size {
            for j in 0..size {
                let apart = (i as f64 - j as f64).abs();
                matrix.values[i * size + j] = 1.0 / (1.0 + apart) + f64::from(u8::from(i == j));
            }
        }
        matrix
    }

    fn times(matrix: &Square, x: &[f64]) -> Vec<f64> {
        (0..matrix.size).map(|k| dot(matrix.row(k), x)).collect()
    }

    #[test]
    fn elimination_pivots() {
        let matrix = Square {
            size: 3,
            values: vec![0.0, 2.0, 1.0, 2.0, 0.0, 0.0, 1.0, 0.0, 3.0],
        };
        let x = [1.0, -2.0, 0.5];
        let found = eliminate(matrix.clone(), times(&matrix, &x)).unwrap();
        for (found, x) in found.iter().zip(x) {
            assert!((found - x).abs() < 1e-14);
        }
        assert!(eliminate(Square::zero(2), vec![1.0, 1.0]).is_none());
    }

    #[test]
    fn three_diagonals_solve_what_the_matrix_does() {
        let size = 40;
        let matrix = sample(size);
        let x: Vec<f64> = (0..size).map(|k| libm::sin(k as f64 * 0.7)).collect();
        let mut ridged = matrix.clone();
        (0..size).for_each(|k| ridged.values[k * size + k] += 0.3);
        let mut right = times(&ridged, &x);
        let both = Tridiagonal::of(matrix);
        both.forward(&mut right);
        let (mut found, log) = both.solve(0.3, &right).unwrap();
        both.back(&mut found);
        for (found, x) in found.iter().zip(&x) {
            assert!((found - x).abs() < 1e-12);
        }
        assert!(log.is_finite());
        assert!(both.solve(-100.0, &right).is_none());
    }

    #[test]
    fn reflections_keep_lengths_and_solve() {
        let columns: Vec<Vec<f64>> = (0..3)
            .map(|p| (0..9).map(|k| (f64::from(k) * 0.3).powi(p)).collect())
            .collect();
        let own = Reflections::of(columns.clone());
        let mut right: Vec<f64> = (0..9).map(|k| 1.0 + 2.0 * (f64::from(k) * 0.3)).collect();
        let before = dot(&right, &right);
        own.forward(&mut right);
        assert!((dot(&right, &right) - before).abs() < 1e-9);
        let x = own.solve_triangle(&right);
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12 && x[2].abs() < 1e-12);
        assert_eq!(own.rank(), 3);
        own.back(&mut right);
        assert!((right[8] - 5.8).abs() < 1e-12);
    }
}
