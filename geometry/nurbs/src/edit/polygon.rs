//! A control polygon in any number of dimensions: a curve in space, or a surface looked at as a
//! curve of whole rows of its control net.

use crate::knots::KnotVector;

/// Control points over knots that need not be clamped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polygon {
    pub(crate) degree: usize,
    pub(crate) knots: Vec<f64>,
    /// Numbers in a point.
    pub(crate) width: usize,
    /// Point by point.
    pub(crate) points: Vec<f64>,
}

impl Polygon {
    pub(crate) fn new(knots: &KnotVector, width: usize, points: Vec<f64>) -> Self {
        debug_assert_eq!(knots.control_count() * width, points.len());
        Self {
            degree: knots.degree(),
            knots: knots.knots().to_vec(),
            width,
            points,
        }
    }

    /// Number of control points.
    pub(crate) fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// Index `k` of the span `knots[k]..knots[k + 1]` that holds a parameter.
    pub(crate) fn span(&self, t: f64) -> usize {
        let after = self.knots.partition_point(|&knot| knot <= t);
        after
            .saturating_sub(1)
            .clamp(self.degree, self.count().saturating_sub(1))
    }

    /// The polar form (blossom) of the polynomial piece over a span: symmetric, linear in each of
    /// its arguments, as many as the degree, and equal to the curve where these agree (Ramshaw
    /// 1989). Control point `i` is the polar form of the knots `i + 1` to `i + degree`.
    pub(crate) fn polar(&self, span: usize, arguments: &[f64]) -> Vec<f64> {
        let (p, w) = (self.degree, self.width);
        debug_assert_eq!(arguments.len(), p);
        let from = span - p;
        let mut d = self.points[from * w..(span + 1) * w].to_vec();
        for (r, &t) in (1..=p).zip(arguments) {
            for j in (r..=p).rev() {
                let i = from + j;
                let (low, high) = (self.knots[i], self.knots[i + p - r + 1]);
                let share = (t - low) / (high - low);
                for k in 0..w {
                    let (before, own) = (d[(j - 1) * w + k], d[j * w + k]);
                    d[j * w + k] = before + share * (own - before);
                }
            }
        }
        d.split_off(p * w)
    }

    /// The same curve over other knots, that hold all of this one's inside their domain.
    pub(crate) fn over(&self, knots: Vec<f64>) -> Self {
        let p = self.degree;
        let count = knots.len() - p - 1;
        let mut points = Vec::with_capacity(count * self.width);
        for i in 0..count {
            points.extend(self.polar(self.span_of(&knots, i, p), &knots[i + 1..=i + p]));
        }
        Self {
            knots,
            points,
            ..*self
        }
    }

    /// A span of this curve that lies under function `i` of a degree over other knots.
    pub(crate) fn span_of(&self, knots: &[f64], i: usize, degree: usize) -> usize {
        let (first, last) = (self.knots[self.degree], self.knots[self.count()]);
        let under = knots[i..=i + degree + 1].windows(2);
        // The middle is beyond doubt in the span, whatever the ends.
        let middles = under
            .filter(|pair| pair[1] > pair[0])
            .map(|pair| (pair[0] + pair[1]) / 2.0);
        let inside = middles.clone().find(|t| (first..=last).contains(t));
        self.span(inside.unwrap_or(first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polar_form_is_the_curve_where_its_arguments_agree_and_has_the_points() {
        let knots = KnotVector::new(3, vec![0., 0., 0., 0., 1., 2.5, 2.5, 4., 4., 4., 4.]).unwrap();
        let points: Vec<f64> = (0..14).map(|k| f64::from(k * k % 11)).collect();
        let curve = Polygon::new(&knots, 2, points.clone());
        for t in [0.0, 0.3, 1.0, 2.5, 3.9, 4.0] {
            let basis = knots.basis(t);
            let value = |d: usize| -> f64 {
                (0..4)
                    .map(|k| basis.values[k] * points[(basis.first + k) * 2 + d])
                    .sum()
            };
            let at = curve.polar(curve.span(t), &[t; 3]);
            assert!((at[0] - value(0)).abs() < 1e-12 && (at[1] - value(1)).abs() < 1e-12);
        }
        let same = curve.over(curve.knots.clone());
        let off = same.points.iter().zip(&points).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12);
    }
}
