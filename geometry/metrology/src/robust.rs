//! Weights that strays have no part in: Tukey's biweight (Huber, Robust Statistics, 1981, 4.8).

/// Residuals beyond so many standard deviations weigh nothing; 95 % efficient on normal noise.
const REACH: f64 = 4.685;
/// Makes the median size of normal residuals their standard deviation.
const NORMAL: f64 = 1.4826;

/// Standard deviation of the residuals by their median size; 0 where there are none.
pub(crate) fn deviation(residuals: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = residuals.map(f64::abs).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    NORMAL * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Weight of a residual in standard deviations.
pub(crate) fn weight(residual: f64) -> f64 {
    let share = residual / REACH;
    if share.abs() >= 1.0 {
        return 0.0;
    }
    let rest = 1.0 - share * share;
    rest * rest
}

/// Sums over residuals in standard deviations, from which follows how much wider a result
/// scatters than the weighted normal matrix says.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spread {
    count: f64,
    weights: f64,
    influence_squares: f64,
    influence_slopes: f64,
}

impl Spread {
    pub(crate) fn add(&mut self, residual: f64) {
        let weight = weight(residual);
        let share = residual / REACH;
        self.count += 1.0;
        self.weights += weight;
        self.influence_squares += (weight * residual) * (weight * residual);
        if share.abs() < 1.0 {
            let square = share * share;
            self.influence_slopes += (1.0 - square) * (1.0 - 5.0 * square);
        }
    }

    /// Factor of the inverse of the weighted normal matrix (Huber 1981, 7.6: the covariance of an
    /// M-estimate, for so many unknowns); 1 for residuals of which nothing can be said.
    pub(crate) fn factor(&self, unknowns: usize) -> f64 {
        let freedom = (self.count - unknowns as f64).max(1.0);
        let slope = self.influence_slopes / self.count.max(1.0);
        let square = self.influence_squares / freedom;
        let factor = square * (self.weights / self.count.max(1.0)) / (slope * slope);
        if factor.is_finite() && factor > 0.0 {
            factor
        } else {
            1.0
        }
    }

    /// How many residuals there are.
    pub(crate) fn samples(&self) -> f64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_weigh_nothing_and_do_not_widen_the_deviation_much() {
        let residuals = |strays: usize| {
            // Quantiles of a normal distribution, by bisection of its integral.
            let quantile = |share: f64| {
                let (mut low, mut high) = (-9.0, 9.0);
                for _ in 0..80 {
                    let middle: f64 = (low + high) / 2.0;
                    if 0.5 * libm::erfc(-middle / core::f64::consts::SQRT_2) < share {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                low
            };
            (0..1000)
                .map(move |k| quantile((f64::from(k) + 0.5) / 1000.0))
                .chain((0..strays).map(|_| 50.0))
        };
        assert!((deviation(residuals(0)) - 1.0).abs() < 0.01);
        assert!((deviation(residuals(100)) - 1.0).abs() < 0.15);
        assert_eq!(weight(50.0), 0.0);
        let mut spread = Spread::default();
        residuals(0).for_each(|r| spread.add(r));
        // The normal matrix is weighed, too: 1 / (0.95 of efficiency), by the mean weight.
        let by_weights = spread.factor(1) / (spread.weights / spread.count);
        assert!((by_weights - 1.0 / 0.95).abs() < 0.01, "{by_weights}");
    }
}
