//! Knot vectors and the B-spline basis.

/// Highest degree for which the basis is offered.
pub const MAX_DEGREE: usize = 9;

/// Values of the basis functions that do not vanish at a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// Index of the first function listed.
    pub first: usize,
    /// `values[k]` belongs to function `first + k`; entries beyond the degree are 0.
    pub values: [f64; MAX_DEGREE + 1],
}

/// Knots of a B-spline of some degree: finite, never descending, the first and last
/// `degree + 1` equal, none inside more than `degree` times.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

/// Why numbers do not make a knot vector.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KnotError {
    /// The degree is 0 or above [`MAX_DEGREE`].
    #[error("degree {0} is outside 1..={MAX_DEGREE}")]
    Degree(usize),
    /// Fewer than `2 (degree + 1)` knots.
    #[error("{given} knots are too few: degree {degree} needs at least {needed}")]
    TooFew {
        /// The degree.
        degree: usize,
        /// Knots given.
        given: usize,
        /// Knots needed.
        needed: usize,
    },
    /// A knot is below its predecessor, or not finite.
    #[error("knot {index} ({value}) is not finite or lies below the one before it")]
    Order {
        /// Index of the knot.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The ends are not `degree + 1` equal knots, or they span nothing.
    #[error("the first and the last {0} knots must be equal, and the first below the last")]
    Clamped(usize),
    /// A knot inside is repeated more than `degree` times.
    #[error("knot {value} is repeated more than {degree} times")]
    Multiplicity {
        /// The degree.
        degree: usize,
        /// The knot.
        value: f64,
    },
}

impl KnotVector {
    /// A checked, clamped knot vector.
    ///
    /// # Errors
    /// [`KnotError`], naming the first knot that is wrong.
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self, KnotError> {
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(KnotError::Degree(degree));
        }
        let (order, given) = (degree + 1, knots.len());
        if given < 2 * order {
            return Err(KnotError::TooFew {
                degree,
                given,
                needed: 2 * order,
            });
        }
        for (index, &value) in knots.iter().enumerate() {
            if !value.is_finite() || (index > 0 && value < knots[index - 1]) {
                return Err(KnotError::Order { index, value });
            }
        }
        let clamped = knots[0] == knots[degree] && knots[given - order] == knots[given - 1];
        if !clamped || knots[0] >= knots[given - 1] {
            return Err(KnotError::Clamped(order));
        }
        for window in knots[1..given - 1].windows(order) {
            let value = window[0];
            if value == window[degree] && value != knots[0] && value != knots[given - 1] {
                return Err(KnotError::Multiplicity { degree, value });
            }
        }
        if knots[order] == knots[0] || knots[given - order - 1] == knots[given - 1] {
            return Err(KnotError::Clamped(order));
        }
        Ok(Self { degree, knots })
    }

    /// Equal spans over `first..=last` with single knots inside.
    ///
    /// # Errors
    /// [`KnotError`] when the interval is empty, `spans` is 0 or the degree out of range.
    pub fn uniform(degree: usize, spans: usize, first: f64, last: f64) -> Result<Self, KnotError> {
        let breaks = |k: usize| {
            if k == spans {
                last
            } else {
                first + (last - first) * k as f64 / spans as f64
            }
        };
        let mut knots = vec![first; degree];
        if spans > 0 {
            knots.extend((0..=spans).map(breaks));
        }
        knots.extend(core::iter::repeat_n(last, degree));
        Self::new(degree, knots)
    }

    /// For knots that satisfy the conditions by construction.
    pub(crate) fn assembled(degree: usize, knots: Vec<f64>) -> Self {
        debug_assert!(Self::new(degree, knots.clone()).is_ok(), "{knots:?}");
        Self { degree, knots }
    }

    /// The degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots, repeated ones as often as they count.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Number of basis functions, and so of control points.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[0], self.knots[self.knots.len() - 1])
    }

    /// The distinct knots.
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots.clone();
        breaks.dedup();
        breaks
    }

    /// Mean of the inner knots of basis function `i` (Greville abscissa).
    ///
    /// # Panics
    /// When there is no function `i`.
    #[must_use]
    pub fn greville(&self, i: usize) -> f64 {
        self.knots[i + 1..=i + self.degree].iter().sum::<f64>() / self.degree as f64
    }

    /// Index `k` of the span `knots[k]..knots[k + 1]` that holds `t`; the first or last
    /// span beyond the ends.
    #[must_use]
    pub fn span(&self, t: f64) -> usize {
        let last = self.control_count() - 1;
        let after = self.knots.partition_point(|&k| k <= t);
        after.saturating_sub(1).clamp(self.degree, last)
    }

    /// The basis functions at `t` by the recurrence of Cox and de Boor.
    #[must_use]
    pub fn basis(&self, t: f64) -> Basis {
        let span = self.span(t);
        Basis {
            first: span - self.degree,
            values: self.values(span, t, self.degree),
        }
    }

    /// The derivatives of an order of the basis functions at `t`; order 0 is
    /// [`Self::basis`].
    #[must_use]
    pub fn basis_derivative(&self, t: f64, order: usize) -> Basis {
        let (span, p) = (self.span(t), self.degree);
        let first = span - p;
        if order > p {
            return Basis {
                first,
                values: [0.0; MAX_DEGREE + 1],
            };
        }
        // Functions of degree p - order, then each difference raises degree and order.
        let mut values = self.values(span, t, p - order);
        for degree in p - order + 1..=p {
            let mut raised = [0.0; MAX_DEGREE + 1];
            for k in 0..=degree {
                let i = span + k - degree;
                let mut sum = 0.0;
                if k > 0 {
                    sum += values[k - 1] / (self.knots[i + degree] - self.knots[i]);
                }
                if k < degree {
                    sum -= values[k] / (self.knots[i + degree + 1] - self.knots[i + 1]);
                }
                raised[k] = degree as f64 * sum;
            }
            values = raised;
        }
        Basis { first, values }
    }

    fn values(&self, span: usize, t: f64, degree: usize) -> [f64; MAX_DEGREE + 1] {
        let mut values = [0.0; MAX_DEGREE + 1];
        values[0] = 1.0;
        for d in 1..=degree {
            let mut carried = 0.0;
            for (k, value) in values.iter_mut().enumerate().take(d) {
                let (low, high) = (self.knots[span + 1 + k - d], self.knots[span + 1 + k]);
                let share = *value / (high - low);
                *value = carried + (high - t) * share;
                carried = (t - low) * share;
            }
            values[d] = carried;
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratic_basis_on_one_span_is_bernstein() {
        let knots = KnotVector::uniform(2, 1, 2.0, 4.0).unwrap();
        let b = knots.basis(2.5);
        let s: f64 = 0.25;
        let bernstein = [(1.0 - s) * (1.0 - s), 2.0 * s * (1.0 - s), s * s];
        for (value, expected) in b.values.iter().zip(bernstein) {
            assert!((value - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn basis_sums_to_one_and_reproduces_the_parameter() {
        let knots = KnotVector::new(3, vec![0., 0., 0., 0., 1., 1., 2.5, 4., 4., 4., 4.]).unwrap();
        for step in 0..=40 {
            let t = 0.1 * f64::from(step);
            let (b, d) = (knots.basis(t), knots.basis_derivative(t, 1));
            let sum: f64 = b.values.iter().sum();
            let linear: f64 = (0..4)
                .map(|k| b.values[k] * knots.greville(b.first + k))
                .sum();
            let slope: f64 = (0..4)
                .map(|k| d.values[k] * knots.greville(b.first + k))
                .sum();
            assert!((sum - 1.0).abs() < 1e-14 && (linear - t).abs() < 1e-14);
            assert!(d.values.iter().sum::<f64>().abs() < 1e-13 && (slope - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let knots = KnotVector::uniform(4, 5, 0.0, 5.0).unwrap();
        let (t, h) = (2.3, 1e-5);
        for order in 1..=4 {
            let d = knots.basis_derivative(t, order);
            let (high, low) = (
                knots.basis_derivative(t + h, order - 1),
                knots.basis_derivative(t - h, order - 1),
            );
            for k in 0..5 {
                let difference = (high.values[k] - low.values[k]) / (2.0 * h);
                assert!((d.values[k] - difference).abs() < 1e-7, "order {order}");
            }
        }
        assert_eq!(knots.basis_derivative(t, 5).values, [0.0; MAX_DEGREE + 1]);
    }

    #[test]
    fn the_last_parameter_belongs_to_the_last_span() {
        let knots = KnotVector::uniform(2, 3, 0.0, 3.0).unwrap();
        let b = knots.basis(3.0);
        assert_eq!((b.first, b.values[2]), (2, 1.0));
        assert_eq!(knots.breaks(), [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn bad_knots_are_named() {
        let error = |degree, knots: &[f64]| KnotVector::new(degree, knots.to_vec()).unwrap_err();
        assert_eq!(error(0, &[0.0, 1.0]), KnotError::Degree(0));
        assert!(matches!(
            error(2, &[0., 0., 1.]),
            KnotError::TooFew { needed: 6, .. }
        ));
        assert!(matches!(
            error(1, &[0., 0., 2., 1., 3., 3.]),
            KnotError::Order { index: 3, .. }
        ));
        assert_eq!(error(1, &[0., 0.5, 1., 1.]), KnotError::Clamped(2));
        assert_eq!(error(1, &[0., 0., 0., 0.]), KnotError::Clamped(2));
        assert_eq!(error(1, &[0., 0., 0., 1., 1.]), KnotError::Clamped(2));
        assert!(matches!(
            error(1, &[0., 0., 1., 1., 2., 2.]),
            KnotError::Multiplicity { .. }
        ));
        assert!(KnotVector::uniform(2, 0, 0.0, 1.0).is_err());
    }
}
