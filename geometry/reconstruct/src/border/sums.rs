//! Least-squares lines and cubics over runs of samples, in constant time for each sample
//! by which a run grows.

use super::segments::Samples;
use crate::polygon::{minus, norm};

/// Running sums over samples from a first one on, relative to it.
pub(crate) struct Sums {
    origin: [f64; 2],
    start: f64,
    /// Arc length of the last sample.
    reach: f64,
    /// Sums of powers 0 to 6 of the arc length.
    powers: [f64; 7],
    /// Sums of x and y times powers 0 to 3.
    x: [f64; 4],
    y: [f64; 4],
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Sums {
    pub(crate) fn start(samples: &Samples, first: usize) -> Self {
        let mut sums = Self {
            origin: samples.points[first],
            start: samples.length[first],
            reach: 0.0,
            powers: [0.0; 7],
            x: [0.0; 4],
            y: [0.0; 4],
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
        };
        sums.push(samples, first);
        sums
    }

    pub(crate) fn push(&mut self, samples: &Samples, sample: usize) {
        let [x, y] = minus(samples.points[sample], self.origin);
        let t = samples.length[sample] - self.start;
        self.reach = t;
        let mut power = 1.0;
        for k in 0..7 {
            self.powers[k] += power;
            if k < 4 {
                self.x[k] += power * x;
                self.y[k] += power * y;
            }
            power *= t;
        }
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
    }

    /// Scatter about the mean: xx, xy, yy.
    fn scatter(&self) -> (f64, f64, f64) {
        let (n, sx, sy) = (self.powers[0], self.x[0], self.y[0]);
        (
            self.xx - sx * sx / n,
            self.xy - sx * sy / n,
            self.yy - sy * sy / n,
        )
    }

    /// Sum of squared distances from the best line.
    pub(crate) fn line_error(&self) -> f64 {
        let (a, b, c) = self.scatter();
        let half = ((a - c) * (a - c) / 4.0 + b * b).sqrt();
        ((a + c) / 2.0 - half).max(0.0)
    }

    /// The best line: its mean point (relative to the first sample) and unit direction.
    pub(crate) fn line(&self) -> ([f64; 2], [f64; 2]) {
        let (a, b, c) = self.scatter();
        let half = ((a - c) * (a - c) / 4.0 + b * b).sqrt();
        // The eigenvector of the greater eigenvalue, in the form that does not cancel.
        let direction = if a >= c {
            [(a - c) / 2.0 + half, b]
        } else {
            [b, (c - a) / 2.0 + half]
        };
        let length = norm(direction);
        let along = if length > 0.0 {
            [direction[0] / length, direction[1] / length]
        } else {
            [1.0, 0.0]
        };
        let n = self.powers[0];
        ([self.x[0] / n, self.y[0] / n], along)
    }

    /// The best cubics of x and y over arc length, relative to the first sample.
    pub(crate) fn cubic(&self) -> Option<([f64; 4], [f64; 4])> {
        let (x, y, _) = self.solve()?;
        let unscale = |c: [f64; 4]| {
            let mut scale = 1.0;
            c.map(|v| {
                let value = v / scale;
                scale *= self.reach;
                value
            })
        };
        Some((unscale(x), unscale(y)))
    }

    /// Sum of squared distances from the best cubics, at equal arc length.
    pub(crate) fn cubic_error(&self) -> f64 {
        self.solve().map_or(f64::INFINITY, |(_, _, error)| error)
    }

    /// Cubics over arc length divided by its reach, and their error.
    fn solve(&self) -> Option<([f64; 4], [f64; 4], f64)> {
        let mut scales = [1.0; 7];
        for k in 1..7 {
            scales[k] = scales[k - 1] * self.reach;
        }
        // Cholesky factor of the matrix of powers.
        let mut l = [[0.0_f64; 4]; 4];
        for i in 0..4 {
            for j in 0..=i {
                let mut sum = self.powers[i + j] / scales[i + j];
                sum -= (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
                if i == j {
                    if sum <= 1e-10 {
                        return None;
                    }
                    l[i][i] = sum.sqrt();
                } else {
                    l[i][j] = sum / l[j][j];
                }
            }
        }
        let mut explained = 0.0;
        let mut solve = |rhs: &[f64; 4]| {
            let mut v = [0.0; 4];
            for i in 0..4 {
                let mut sum = rhs[i] / scales[i];
                for k in 0..i {
                    sum -= l[i][k] * v[k];
                }
                v[i] = sum / l[i][i];
                explained += v[i] * v[i];
            }
            for i in (0..4).rev() {
                let mut sum = v[i];
                for k in i + 1..4 {
                    sum -= l[k][i] * v[k];
                }
                v[i] = sum / l[i][i];
            }
            v
        };
        let (x, y) = (solve(&self.x), solve(&self.y));
        Some((x, y, (self.xx + self.yy - explained).max(0.0)))
    }
}
