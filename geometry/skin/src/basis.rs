//! The functions around sections: B-splines over breaks, closed ones going on from the last break to
//! the first.

use nurbs::BSplineCurve;

/// Degree around sections.
pub(crate) const DEGREE: usize = 3;
const ORDER: usize = DEGREE + 1;

/// Fewest spans of a closed curve, so that its functions are different ones.
pub(crate) const LEAST_SPANS: usize = 4;

/// B-splines around sections, over 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Basis {
    pub(crate) breaks: Vec<f64>,
    pub(crate) is_closed: bool,
}

/// The functions that do not vanish at a place: which, and their values.
pub(crate) type Local = [(usize, f64); ORDER];

impl Basis {
    pub(crate) fn spans(&self) -> usize {
        self.breaks.len() - 1
    }

    /// Functions, and so control points that are free.
    pub(crate) fn functions(&self) -> usize {
        if self.is_closed {
            self.spans()
        } else {
            self.spans() + DEGREE
        }
    }

    /// Control points as they are written, over a clamped knot vector.
    pub(crate) fn written(&self) -> usize {
        self.spans() + DEGREE
    }

    pub(crate) fn span(&self, t: f64) -> usize {
        let after = self.breaks.partition_point(|b| *b <= t);
        after.saturating_sub(1).min(self.spans() - 1)
    }

    /// Knot `k`, of which the breaks are those from 0 on.
    fn knot(&self, k: isize) -> f64 {
        let spans = self.spans() as isize;
        if self.is_closed {
            let turns = k.div_euclid(spans);
            self.breaks[k.rem_euclid(spans) as usize] + turns as f64
        } else {
            self.breaks[k.clamp(0, spans) as usize]
        }
    }

    /// By the recurrence of Cox and de Boor.
    pub(crate) fn at(&self, t: f64) -> Local {
        let span = self.span(t) as isize;
        let mut values = [0.0; ORDER];
        values[0] = 1.0;
        for d in 1..=DEGREE {
            let mut carried = 0.0;
            for (k, value) in values.iter_mut().enumerate().take(d) {
                let from = span + 1 + k as isize;
                let (low, high) = (self.knot(from - d as isize), self.knot(from));
                let share = *value / (high - low);
                *value = carried + (high - t) * share;
                carried = (t - low) * share;
            }
            values[d] = carried;
        }
        let functions = self.functions() as isize;
        core::array::from_fn(|k| {
            let function = if self.is_closed {
                (span + k as isize - DEGREE as isize).rem_euclid(functions)
            } else {
                span + k as isize
            };
            (function as usize, values[k])
        })
    }

    /// The curve over a clamped knot vector. `None` where breaks do not ascend.
    pub(crate) fn curve(&self, points: &[[f64; 3]]) -> Option<BSplineCurve<3>> {
        if self.is_closed {
            return BSplineCurve::periodic(DEGREE, &self.breaks, points).ok();
        }
        let (first, last) = (self.breaks[0], self.breaks[self.spans()]);
        let knots = [vec![first; DEGREE], self.breaks.clone(), vec![last; DEGREE]].concat();
        let knots = nurbs::KnotVector::new(DEGREE, knots).ok()?;
        BSplineCurve::new(knots, points.to_vec()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_those_of_the_curve() {
        let breaks = vec![0.0, 0.1, 0.35, 0.5, 0.8, 1.0];
        for is_closed in [true, false] {
            let basis = Basis {
                breaks: breaks.clone(),
                is_closed,
            };
            let point = |k: usize| [k as f64, (k * k % 7) as f64, 1.0];
            let points: Vec<[f64; 3]> = (0..basis.functions()).map(point).collect();
            let curve = basis.curve(&points).unwrap();
            assert_eq!(curve.points().len(), basis.written());
            for t in [0.0, 0.05, 0.1, 0.49, 0.79, 0.99] {
                let local = basis.at(t);
                for (d, on) in curve.evaluate(t).into_iter().enumerate() {
                    let sum: f64 = local.iter().map(|(k, value)| value * points[*k][d]).sum();
                    assert!((sum - on).abs() < 1e-12, "{t} {sum} {on}");
                }
            }
        }
    }
}
