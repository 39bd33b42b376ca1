//! Least squares for some of a spline's coefficients, the others held.

use super::UniformSpline;
use super::design::{Design, Lines, runs};

/// Most steps of the conjugate gradients.
const MAX_STEPS: usize = 60;

/// Part of the first gradient, in the norm of the preconditioner, at which they end.
const CONVERGED: f64 = 1e-4;

/// What single basis functions would gain if each alone were added to a spline.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Decrease of the weighted sum of squared residuals, for each function, v fastest.
    pub gain: Vec<f64>,
    /// Weighted sum of the function's squared values at the observations.
    pub mass: Vec<f64>,
}

impl Scores {
    /// Size of the coefficient that makes the gain of function `k`; 0 without data.
    #[must_use]
    pub fn amplitude(&self, k: usize) -> f64 {
        let mass = self.mass[k];
        if mass > 0.0 {
            (self.gain[k] / mass).sqrt()
        } else {
            0.0
        }
    }
}

/// Second differences of neighbouring coefficients, all of them free.
struct Bending {
    /// Index of the middle coefficient and distance to its neighbours in the list.
    triples: Vec<(usize, usize)>,
    weight: f64,
}

impl Bending {
    fn new(free: &[bool], columns: usize, rows: usize, weight: f64) -> Self {
        let mut triples = Vec::new();
        for i in 0..columns {
            for j in 0..rows {
                let k = i * rows + j;
                let mut take = |stride: usize| {
                    if free[k - stride] && free[k] && free[k + stride] {
                        triples.push((k, stride));
                    }
                };
                if i > 0 && i + 1 < columns {
                    take(rows);
                }
                if j > 0 && j + 1 < rows {
                    take(1);
                }
            }
        }
        Self { triples, weight }
    }

    fn add_to(&self, x: &[f64], product: &mut [f64]) {
        for &(k, stride) in &self.triples {
            let second = self.weight * (x[k - stride] - 2.0 * x[k] + x[k + stride]);
            product[k - stride] += second;
            product[k] -= 2.0 * second;
            product[k + stride] += second;
        }
    }

    fn add_diagonal(&self, diagonal: &mut [f64]) {
        for &(k, stride) in &self.triples {
            diagonal[k - stride] += self.weight;
            diagonal[k] += 4.0 * self.weight;
            diagonal[k + stride] += self.weight;
        }
    }
}

impl UniformSpline {
    /// What each basis function alone could take from the residuals.
    #[must_use]
    pub fn scores(&self, lines: &Lines<'_>, residuals: &[f64]) -> Scores {
        let design = Design::new(self, lines);
        let mut products = vec![0.0; self.coefficients.len()];
        design.sums(residuals, &mut products);
        let mass = design.masses();
        let gain = products
            .iter()
            .zip(&mass)
            .map(|(p, m)| if *m > 0.0 { p * p / m } else { 0.0 });
        Scores {
            gain: gain.collect(),
            mass,
        }
    }

    /// The observations less the spline.
    #[must_use]
    pub fn residuals(&self, lines: &Lines<'_>) -> Vec<f64> {
        let mut values = vec![0.0; lines.observations().len()];
        Design::new(self, lines).values(&self.coefficients, &mut values);
        let pairs = values.iter().zip(lines.observations());
        pairs.map(|(value, o)| o.value - value).collect()
    }

    /// Adds to the free coefficients (v fastest) what brings the spline nearest to the
    /// observations, and takes it from the residuals. `bending` times the greatest of the
    /// functions' masses weighs the second differences of what is added: it carries the
    /// change on in straight lines where there are no data. The knots of the free functions
    /// are in use from now on.
    ///
    /// # Panics
    /// When the counts do not match.
    pub fn improve(
        &mut self,
        lines: &Lines<'_>,
        residuals: &mut [f64],
        free: &[bool],
        bending: f64,
    ) {
        assert_eq!(
            free.len(),
            self.coefficients.len(),
            "as many as coefficients"
        );
        let design = Design::new(self, lines);
        let mut diagonal = design.masses();
        let greatest = diagonal.iter().copied().fold(0.0, f64::max);
        let curb = Bending::new(free, design.columns, design.rows, bending * greatest);
        curb.add_diagonal(&mut diagonal);
        // What neither data nor neighbours determine stays as it is.
        let least = 1e-9 * greatest;
        for d in &mut diagonal {
            *d += least;
        }

        // Of each vector only what is free is looked at; the rest of the direction and of the
        // change is 0.
        let design = design.restricted(free);
        let runs = runs(0..free.len(), |k| free[k]);
        let all_free = || runs.iter().cloned().flatten();
        let dot = |a: &[f64], b: &[f64]| -> f64 { all_free().map(|k| a[k] * b[k]).sum() };
        let mut gradient = vec![0.0; free.len()];
        design.sums(residuals, &mut gradient);
        let mut change = vec![0.0; free.len()];
        let mut direction = vec![0.0; free.len()];
        let mut next = vec![0.0; free.len()];
        let mut product = vec![0.0; free.len()];
        all_free().for_each(|k| direction[k] = gradient[k] / diagonal[k]);
        let mut size = dot(&gradient, &direction);
        let enough = CONVERGED * CONVERGED * size;
        let mut values = vec![0.0; residuals.len()];
        for _ in 0..MAX_STEPS {
            if size <= enough || !size.is_finite() {
                break;
            }
            design.values(&direction, &mut values);
            design.sums(&values, &mut product);
            curb.add_to(&direction, &mut product);
            all_free().for_each(|k| product[k] += least * direction[k]);
            let step = size / dot(&direction, &product);
            for k in all_free() {
                change[k] += step * direction[k];
                gradient[k] -= step * product[k];
                next[k] = gradient[k] / diagonal[k];
            }
            let before = size;
            size = dot(&gradient, &next);
            let share = size / before;
            all_free().for_each(|k| direction[k] = next[k] + share * direction[k]);
        }

        design.values(&change, &mut values);
        for (r, v) in residuals.iter_mut().zip(&values) {
            *r -= v;
        }
        let rows = design.rows;
        for (c, change) in self.coefficients.iter_mut().zip(&change) {
            *c += change;
        }
        for (k, _) in free.iter().enumerate().filter(|(_, free)| **free) {
            self.u.use_function(k / rows);
            self.v.use_function(k % rows);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Observation;
    use crate::uniform::Parameter;

    fn data(value: impl Fn(f64, f64) -> f64) -> Vec<Observation> {
        let mut data = Vec::new();
        for i in 0..40 {
            for j in 0..30 {
                let (u, v) = (0.25 * f64::from(i), 0.2 * f64::from(j));
                data.push(Observation {
                    u,
                    v,
                    value: value(u, v),
                    weight: 1.0 + f64::from((i + j) % 3),
                });
            }
        }
        data
    }

    fn start(data: &[Observation]) -> UniformSpline {
        let (u, v) = ((0.0, 10.0), (0.0, 6.0));
        let mut spline = UniformSpline::fit_polynomial(u, v, &[(0, 0)], data, 0.0).unwrap();
        for along in [Parameter::U, Parameter::V, Parameter::U, Parameter::V] {
            spline = spline.halved(along);
        }
        spline
    }

    #[test]
    fn the_residuals_of_the_best_fit_are_square_to_every_function() {
        let data = data(|u, v| libm::sin(3.0 * u) + (7.0 * v) % 1.0);
        let lines = Lines::new(&data);
        let mut spline = start(&data);
        let mut residuals = spline.residuals(&lines);
        let before: f64 = spline.scores(&lines, &residuals).gain.iter().sum();
        let free = vec![true; 49];
        for _ in 0..3 {
            spline.improve(&lines, &mut residuals, &free, 0.0);
        }
        let after: f64 = spline.scores(&lines, &residuals).gain.iter().sum();
        assert!(after < 1e-9 * before, "{after} of {before}");
        for (kept, fresh) in residuals.iter().zip(spline.residuals(&lines)) {
            assert!((kept - fresh).abs() < 1e-10);
        }
    }

    #[test]
    fn only_free_functions_change_and_their_knots_come_into_use() {
        let data = data(|u, v| libm::exp(-(u - 2.0) * (u - 2.0) - (v - 2.0) * (v - 2.0)));
        let lines = Lines::new(&data);
        let mut spline = start(&data);
        let before = spline.clone();
        let mut residuals = spline.residuals(&lines);
        let mut free = vec![false; 49];
        free[2 * 7 + 2] = true;
        spline.improve(&lines, &mut residuals, &free, 1e-4);
        for (k, free) in free.iter().enumerate() {
            let same = spline.coefficients[k] == before.coefficients[k];
            assert_eq!(same, !free, "{k}");
        }
        let patches = spline.to_patches().unwrap();
        assert_eq!(patches.u_breaks, [0.0, 2.5, 5.0, 7.5, 10.0]);
        for (u, v) in [(2.0, 2.0), (0.1, 5.9), (9.9, 0.3)] {
            assert!((patches.z(u, v) - spline.value(u, v)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_change_goes_on_in_a_straight_line_where_there_are_no_data() {
        let mut data = data(|u, v| 2.0 + 0.7 * u - 1.3 * v);
        data.retain(|o| o.u + o.v < 5.0);
        let lines = Lines::new(&data);
        let mut spline = start(&data);
        let mut residuals = spline.residuals(&lines);
        for _ in 0..20 {
            spline.improve(&lines, &mut residuals, &[true; 49], 1e-3);
        }
        for (u, v) in [(1.0, 1.0), (6.0, 1.0), (4.0, 5.0)] {
            let off = spline.value(u, v) - (2.0 + 0.7 * u - 1.3 * v);
            // The steps of each improvement are limited, and the last place is 3 away from data.
            assert!(off.abs() < 0.05, "{off} at {u}, {v}");
        }
    }
}
