//! A small piece of one region's surface, fitted to the nodes on its side of a border and
//! carried on across it.

/// Terms of z over (u, v): 1, u, v, u^2, uv, v^2.
const TERMS: usize = 6;
/// Fewer nodes than this give no plane worth carrying on.
const LEAST_FOR_PLANE: f64 = 7.0;
/// Fewer nodes than this give no quadratic worth carrying on.
const LEAST_FOR_QUADRATIC: f64 = 18.0;
/// From which F ratio the quadratic is believed. The 1 % point of F(3, many) is 4, but noise
/// that is alike in neighbouring nodes passes for shape and raises the ratio about threefold.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Belief {
    /// Where a plane that misses a curvature would do more harm than a quadratic that follows
    /// noise, as when directions are compared at many places.
    Ready,
    /// Where the surface is carried on by some nodes, in which a plane strays less.
    Reluctant,
}

impl Belief {
    fn least_ratio(self) -> f64 {
        match self {
            Self::Ready => 5.0,
            Self::Reluctant => 12.0,
        }
    }
}

/// Powers of u and v in each term.
const POWERS: [(usize, usize); TERMS] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];

/// Weighted sums over nodes of one label in one column, by powers of v.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ColumnSums {
    powers: [f64; 5],
    z: [f64; 3],
    z_squared: f64,
}

/// Weighted sums over the nodes of one label, u and v in pitches from a common centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums {
    pub(crate) label: u32,
    /// Of u^a v^b, where a + b is at most 4.
    moments: [[f64; 5]; 5],
    /// Of u^a v^b z, where a + b is at most 2.
    z: [[f64; 3]; 3],
    z_squared: f64,
}

/// A fitted piece of surface, z in millimetres over u and v in pitches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalFit {
    terms: [f64; TERMS],
    /// Centroid of the nodes.
    pub(crate) centroid: [f64; 2],
}

impl ColumnSums {
    pub(crate) fn add(&mut self, v: f64, z_mm: f64, weight: f64) {
        let mut term = weight;
        for k in 0..5 {
            self.powers[k] += term;
            if k < 3 {
                self.z[k] += term * z_mm;
            }
            term *= v;
        }
        self.z_squared += weight * z_mm * z_mm;
    }
}

impl Sums {
    pub(crate) fn new(label: u32) -> Self {
        Self {
            label,
            moments: [[0.0; 5]; 5],
            z: [[0.0; 3]; 3],
            z_squared: 0.0,
        }
    }

    /// Adds nodes of the column at u.
    pub(crate) fn add(&mut self, u: f64, column: &ColumnSums) {
        let mut power = 1.0;
        for a in 0..5 {
            for b in 0..5 - a {
                self.moments[a][b] += power * column.powers[b];
            }
            for b in 0..3_usize.saturating_sub(a) {
                self.z[a][b] += power * column.z[b];
            }
            power *= u;
        }
        self.z_squared += column.z_squared;
    }

    fn fit_of(&self, terms: [f64; TERMS]) -> LocalFit {
        let weight = self.moments[0][0];
        let centroid = [self.moments[1][0] / weight, self.moments[0][1] / weight];
        LocalFit { terms, centroid }
    }

    /// The plane, or the quadratic where it is clearly nearer to the nodes; `None` with too
    /// few nodes, or nodes on a line.
    pub(crate) fn fit(&self, belief: Belief) -> Option<LocalFit> {
        let weight = self.moments[0][0];
        if weight < LEAST_FOR_PLANE {
            return None;
        }
        let (plane, plane_error) = self.solve::<3>()?;
        let mut terms = [0.0; TERMS];
        terms[..3].copy_from_slice(&plane);
        if weight >= LEAST_FOR_QUADRATIC
            && let Some((quadratic, error)) = self.solve::<TERMS>()
            && (plane_error - error) * (weight - TERMS as f64) > belief.least_ratio() * 3.0 * error
        {
            terms = quadratic;
        }
        Some(self.fit_of(terms))
    }

    /// Cholesky solution of the first N normal equations, and the squared error left.
    fn solve<const N: usize>(&self) -> Option<([f64; N], f64)> {
        let normal = |i: usize, j: usize| {
            let ((a, b), (c, d)) = (POWERS[i], POWERS[j]);
            self.moments[a + c][b + d]
        };
        let mut factor = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let mut sum = normal(i, j);
                for (a, b) in factor[i].iter().zip(factor[j]).take(j) {
                    sum -= a * b;
                }
                if i == j {
                    // What is left of a term that the others already make up.
                    if sum <= 1e-7 * normal(i, i) {
                        return None;
                    }
                    factor[i][i] = libm::sqrt(sum);
                } else {
                    factor[i][j] = sum / factor[j][j];
                }
            }
        }
        let mut solution = [0.0; N];
        let mut error = self.z_squared;
        for i in 0..N {
            let mut sum = self.z[POWERS[i].0][POWERS[i].1];
            for (factor, known) in factor[i].iter().zip(solution).take(i) {
                sum -= factor * known;
            }
            solution[i] = sum / factor[i][i];
            error -= solution[i] * solution[i];
        }
        for i in (0..N).rev() {
            let mut sum = solution[i];
            for (row, known) in factor.iter().zip(solution).skip(i + 1) {
                sum -= row[i] * known;
            }
            solution[i] = sum / factor[i][i];
        }
        Some((solution, error.max(0.0)))
    }
}

impl LocalFit {
    /// z, millimetres.
    pub(crate) fn z_mm(&self, u: f64, v: f64) -> f64 {
        let [a, b, c, d, e, f] = self.terms;
        a + b * u + c * v + d * u * u + e * u * v + f * v * v
    }

    /// Rise of z in u and v, millimetres per pitch.
    pub(crate) fn rise_mm(&self, u: f64, v: f64) -> [f64; 2] {
        let [_, b, c, d, e, f] = self.terms;
        [b + 2.0 * d * u + e * v, c + e * u + 2.0 * f * v]
    }

    /// Unit normal on the camera's side.
    pub(crate) fn normal(&self, pitch_mm: f64, u: f64, v: f64) -> [f64; 3] {
        let [p, q] = self.rise_mm(u, v).map(|rise| rise / pitch_mm);
        let length = libm::sqrt(1.0 + p * p + q * q);
        [-p / length, -q / length, 1.0 / length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_is_found_and_carried_on() {
        let surface = |u: f64, v: f64| 1.0 + 0.3 * u - 0.2 * v + 0.05 * u * u - 0.02 * u * v;
        let mut sums = Sums::new(1);
        for u in (-6..0).map(f64::from) {
            let mut column = ColumnSums::default();
            for v in (-6..=6).map(f64::from) {
                column.add(v, surface(u, v), 1.0);
            }
            sums.add(u, &column);
        }
        let fit = sums.fit(Belief::Ready).unwrap();
        assert!((fit.z_mm(2.0, 1.0) - surface(2.0, 1.0)).abs() < 1e-9);
        let rise = fit.rise_mm(2.0, 1.0);
        assert!((rise[0] - (0.3 + 0.2 - 0.02)).abs() < 1e-9, "{rise:?}");
        assert!((rise[1] - (-0.2 - 0.04)).abs() < 1e-9, "{rise:?}");
        assert!((fit.centroid[0] + 3.5).abs() < 1e-12);
    }

    #[test]
    fn nodes_on_a_line_give_nothing() {
        let mut sums = Sums::new(1);
        for k in 0..40 {
            let mut column = ColumnSums::default();
            column.add(2.0 * f64::from(k), 1.0, 1.0);
            sums.add(f64::from(k), &column);
        }
        assert!(sums.fit(Belief::Ready).is_none());
    }
}
