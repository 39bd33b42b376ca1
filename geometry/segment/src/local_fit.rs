//! A small piece of one region's surface, fitted to the nodes on its side of a border and
//! carried on across it.

/// Terms of z over (u, v): 1, u, v, u^2, uv, v^2.
const TERMS: usize = 6;
/// Fewer nodes than this give no plane worth carrying on.
const LEAST_FOR_PLANE: f64 = 7.0;
/// Fewer nodes than this give no quadratic worth carrying on.
const LEAST_FOR_QUADRATIC: f64 = 18.0;
/// F ratio from which the quadratic is believed: 1 % point of F(3, many) and some more, since
/// the noise of neighbouring nodes is not independent.
const BELIEF: f64 = 6.0;

/// Weighted sums over the nodes of one label, u and v in pitches from a common centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums {
    pub(crate) label: u32,
    normal: [[f64; TERMS]; TERMS],
    right: [f64; TERMS],
    squares: f64,
}

/// A fitted piece of surface, z in millimetres over u and v in pitches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalFit {
    terms: [f64; TERMS],
    /// Centroid of the nodes.
    pub(crate) centroid: [f64; 2],
}

impl Sums {
    pub(crate) fn new(label: u32) -> Self {
        Self {
            label,
            normal: [[0.0; TERMS]; TERMS],
            right: [0.0; TERMS],
            squares: 0.0,
        }
    }

    pub(crate) fn add(&mut self, u: f64, v: f64, z_mm: f64, weight: f64) {
        let terms = [1.0, u, v, u * u, u * v, v * v];
        for (i, (row, term)) in self.normal.iter_mut().zip(terms).enumerate() {
            let weighted = weight * term;
            for (sum, term) in row.iter_mut().zip(terms).take(i + 1) {
                *sum += weighted * term;
            }
            self.right[i] += weighted * z_mm;
        }
        self.squares += weight * z_mm * z_mm;
    }

    /// The plane, or the quadratic where it is clearly nearer to the nodes; `None` with too
    /// few nodes, or nodes on a line.
    pub(crate) fn fit(&self) -> Option<LocalFit> {
        let weight = self.normal[0][0];
        if weight < LEAST_FOR_PLANE {
            return None;
        }
        let (plane, plane_error) = self.solve::<3>()?;
        let mut terms = [0.0; TERMS];
        terms[..3].copy_from_slice(&plane);
        if weight >= LEAST_FOR_QUADRATIC
            && let Some((quadratic, error)) = self.solve::<TERMS>()
            && (plane_error - error) * (weight - TERMS as f64) > BELIEF * 3.0 * error
        {
            terms = quadratic;
        }
        let centroid = [self.normal[1][0] / weight, self.normal[2][0] / weight];
        Some(LocalFit { terms, centroid })
    }

    /// Cholesky solution of the first N normal equations, and the squared error left.
    fn solve<const N: usize>(&self) -> Option<([f64; N], f64)> {
        let mut factor = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let mut sum = self.normal[i][j];
                for (a, b) in factor[i].iter().zip(factor[j]).take(j) {
                    sum -= a * b;
                }
                if i == j {
                    // What is left of a term that the others already make up.
                    if sum <= 1e-7 * self.normal[i][i] {
                        return None;
                    }
                    factor[i][i] = libm::sqrt(sum);
                } else {
                    factor[i][j] = sum / factor[j][j];
                }
            }
        }
        let mut solution = [0.0; N];
        let mut error = self.squares;
        for i in 0..N {
            let mut sum = self.right[i];
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
        for u in -6..0 {
            for v in -6..=6 {
                let (u, v) = (f64::from(u), f64::from(v));
                sums.add(u, v, surface(u, v), 1.0);
            }
        }
        let fit = sums.fit().unwrap();
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
            sums.add(f64::from(k), 2.0 * f64::from(k), 1.0, 1.0);
        }
        assert!(sums.fit().is_none());
    }
}
