//! The normal equations of a grid with masked nodes, solved by elimination.
//!
//! They couple each coefficient with those three to either side along both axes: numbered along the
//! shorter axis first, a band as wide as three times that.

use nurbs::{BandedCholesky, BandedMatrix};

use crate::axis::{Axis, DEGREE};

/// Multiplications of the elimination for each node, at most: a few of the hundreds of steps that
/// conjugate gradients take where little of a grid has data.
const MOST_WORK: usize = 100;

/// The factored system.
pub(crate) struct Normal {
    system: BandedCholesky,
    /// Coefficients along x and y.
    counts: [usize; 2],
}

impl Normal {
    /// Nodes count by their `weight`. `None` where that is too much work, or the nodes do not
    /// determine the coefficients.
    pub(crate) fn new(u: &Axis, v: &Axis, weight: impl Fn(usize) -> f64) -> Option<Self> {
        let rows = v.at.len();
        let is_along_v = v.count <= u.count;
        let (outer, inner) = if is_along_v { (u, v) } else { (v, u) };
        let bandwidth = DEGREE * inner.count + DEGREE;
        let work = (u.count * v.count).checked_mul(bandwidth * bandwidth)?;
        if work > MOST_WORK * u.at.len() * rows {
            return None;
        }
        let mut matrix = BandedMatrix::zero(u.count * v.count, bandwidth);
        for (a, across) in outer.at.iter().enumerate() {
            // Of this line alone: by coefficient, those 0 to 3 before it.
            let mut line = vec![[0.0; DEGREE + 1]; inner.count];
            for (b, along) in inner.at.iter().enumerate() {
                let n = if is_along_v {
                    a * rows + b
                } else {
                    b * rows + a
                };
                let weight = weight(n);
                for k in 0..=DEGREE {
                    for l in 0..=k {
                        line[along.first + k][k - l] += weight * along.values[k] * along.values[l];
                    }
                }
            }
            for k in 0..=DEGREE {
                for l in 0..=k {
                    let factor = across.values[k] * across.values[l];
                    let at = [k, l].map(|k| (across.first + k) * inner.count);
                    for (row, before) in line.iter().enumerate() {
                        for (d, value) in before.iter().enumerate().take(row + 1) {
                            matrix.add(at[0] + row, at[1] + row - d, factor * value);
                            if k != l && d > 0 {
                                matrix.add(at[0] + row - d, at[1] + row, factor * value);
                            }
                        }
                    }
                }
            }
        }
        Some(Self {
            system: matrix.cholesky().ok()?,
            counts: [u.count, v.count],
        })
    }

    /// Coefficients, y fastest, of a right-hand side in the same order.
    pub(crate) fn solve(&self, mut rhs: Vec<f64>) -> Vec<f64> {
        let [u, v] = self.counts;
        if v <= u {
            self.system.solve(&mut rhs);
            return rhs;
        }
        let mut turned: Vec<f64> = (0..u * v).map(|n| rhs[n % u * v + n / u]).collect();
        self.system.solve(&mut turned);
        (0..u * v).map(|n| turned[n % v * u + n / v]).collect()
    }
}
