//! Evaluation and surgery of piecewise cubic curves.

use super::{PiecewiseCubic, PiecewiseError, check_breaks, cubic, cubic_through_thirds, piece_at};

/// Abscissae and weights of Gauss' rule with five points on -1..1.
const GAUSS_5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Parts into which a piece is cut before Gauss' rule measures it.
const ARC_PARTS: usize = 4;

impl<const D: usize> PiecewiseCubic<D> {
    /// A checked curve.
    ///
    /// # Errors
    /// [`PiecewiseError`] when counts do not match, breaks do not ascend or a number is
    /// not finite.
    pub fn new(breaks: Vec<f64>, pieces: Vec<[[f64; 4]; D]>) -> Result<Self, PiecewiseError> {
        let curve = Self { breaks, pieces };
        curve.validate()?;
        Ok(curve)
    }

    /// The straight line between two points, over `0..=length`.
    ///
    /// # Errors
    /// [`PiecewiseError::Breaks`] when `length` is not positive and finite.
    pub fn line(start: [f64; D], end: [f64; D], length: f64) -> Result<Self, PiecewiseError> {
        let mut piece = [[0.0; 4]; D];
        for d in 0..D {
            piece[d] = [start[d], (end[d] - start[d]) / length, 0.0, 0.0];
        }
        Self::new(vec![0.0, length], vec![piece])
    }

    /// The single cubic over `first..=last` through the points at its ends and thirds
    /// (Shim & Lee 1995, equation 7).
    ///
    /// # Errors
    /// [`PiecewiseError`] when the interval is empty or a number is not finite.
    pub fn through_thirds(
        first: f64,
        last: f64,
        points: &[[f64; D]; 4],
    ) -> Result<Self, PiecewiseError> {
        let mut piece = [[0.0; 4]; D];
        for (d, coefficients) in piece.iter_mut().enumerate() {
            let values = [points[0][d], points[1][d], points[2][d], points[3][d]];
            *coefficients = cubic_through_thirds(values, last - first);
        }
        Self::new(vec![first, last], vec![piece])
    }

    /// Checks what [`Self::new`] checks; for curves whose fields were filled by hand.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn validate(&self) -> Result<(), PiecewiseError> {
        check_breaks(&self.breaks)?;
        if self.pieces.len() + 1 != self.breaks.len() {
            return Err(PiecewiseError::Count {
                breaks: self.breaks.len(),
                expected: self.breaks.len() - 1,
                pieces: self.pieces.len(),
            });
        }
        let broken = |p: &[[f64; 4]; D]| p.iter().flatten().any(|c| !c.is_finite());
        match self.pieces.iter().position(broken) {
            Some(index) => Err(PiecewiseError::Coefficient { index }),
            None => Ok(()),
        }
    }

    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        (
            self.breaks.first().copied().unwrap_or(0.0),
            self.breaks.last().copied().unwrap_or(0.0),
        )
    }

    /// The point at parameter `t`; beyond the ends the end pieces go on.
    #[must_use]
    pub fn evaluate(&self, t: f64) -> [f64; D] {
        self.derivative(t, 0)
    }

    /// The derivative of an order (0 is the point itself) at parameter `t`; at a break
    /// the piece to the right counts, at the last one the piece to the left.
    #[must_use]
    pub fn derivative(&self, t: f64, order: usize) -> [f64; D] {
        let k = piece_at(&self.breaks, t);
        self.piece_value(k, t - self.breaks[k], order)
    }

    /// The derivative of an order on piece `k` at `s` from its start.
    ///
    /// # Panics
    /// When there is no piece `k`.
    #[must_use]
    pub fn piece_value(&self, k: usize, s: f64, order: usize) -> [f64; D] {
        let mut value = [0.0; D];
        for (v, c) in value.iter_mut().zip(&self.pieces[k]) {
            *v = cubic(c, s, order);
        }
        value
    }

    /// The point where the curve begins.
    #[must_use]
    pub fn start(&self) -> [f64; D] {
        self.piece_value(0, 0.0, 0)
    }

    /// The point where the curve ends.
    #[must_use]
    pub fn end(&self) -> [f64; D] {
        let k = self.pieces.len() - 1;
        self.piece_value(k, self.breaks[k + 1] - self.breaks[k], 0)
    }

    /// The same curve run the other way, over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let (first, last) = self.domain();
        let mut breaks: Vec<f64> = self
            .breaks
            .iter()
            .rev()
            .map(|b| first + (last - b))
            .collect();
        // The ends must not pick up rounding from the reflection.
        if let Some(b) = breaks.first_mut() {
            *b = first;
        }
        if let Some(b) = breaks.last_mut() {
            *b = last;
        }
        let pieces = (0..self.pieces.len())
            .rev()
            .map(|k| {
                let width = self.breaks[k + 1] - self.breaks[k];
                self.pieces[k].map(|c| {
                    [
                        cubic(&c, width, 0),
                        -cubic(&c, width, 1),
                        cubic(&c, width, 2) / 2.0,
                        -c[3],
                    ]
                })
            })
            .collect();
        Self { breaks, pieces }
    }

    /// The part between two parameters, over `from..=to`; `None` unless `from < to` and
    /// both lie in the domain.
    #[must_use]
    pub fn restricted(&self, from: f64, to: f64) -> Option<Self> {
        let (first, last) = self.domain();
        let inside = first <= from && from < to && to <= last;
        if !inside {
            return None;
        }
        let (a, mut b) = (piece_at(&self.breaks, from), piece_at(&self.breaks, to));
        if b > a && self.breaks[b] >= to {
            b -= 1;
        }
        let mut breaks = vec![from];
        let mut pieces = Vec::with_capacity(b - a + 1);
        for k in a..=b {
            let shift = (from - self.breaks[k]).max(0.0);
            pieces.push(self.pieces[k].map(|c| {
                [
                    cubic(&c, shift, 0),
                    cubic(&c, shift, 1),
                    cubic(&c, shift, 2) / 2.0,
                    c[3],
                ]
            }));
            breaks.push(self.breaks[k + 1].min(to));
        }
        Some(Self { breaks, pieces })
    }

    /// The two parts on either side of a parameter; `None` unless it lies strictly
    /// inside the domain.
    #[must_use]
    pub fn split(&self, t: f64) -> Option<(Self, Self)> {
        let (first, last) = self.domain();
        Some((self.restricted(first, t)?, self.restricted(t, last)?))
    }

    /// Length of the curve, in the unit of its points.
    #[must_use]
    pub fn arc_length(&self) -> f64 {
        (0..self.pieces.len()).map(|k| self.piece_length(k)).sum()
    }

    fn piece_length(&self, k: usize) -> f64 {
        let part = (self.breaks[k + 1] - self.breaks[k]) / ARC_PARTS as f64;
        let mut length = 0.0;
        for p in 0..ARC_PARTS {
            for (x, weight) in GAUSS_5 {
                let s = part * (p as f64 + (x + 1.0) / 2.0);
                let speed = self.piece_value(k, s, 1);
                let speed = speed.iter().map(|v| v * v).sum::<f64>().sqrt();
                length += weight * speed * part / 2.0;
            }
        }
        length
    }

    /// Points along the curve: the start, then `per_piece` for each piece, the last of
    /// them where the piece ends.
    #[must_use]
    pub fn sampled(&self, per_piece: usize) -> Vec<[f64; D]> {
        let mut points = Vec::with_capacity(self.pieces.len() * per_piece + 1);
        points.push(self.start());
        for k in 0..self.pieces.len() {
            let width = self.breaks[k + 1] - self.breaks[k];
            for p in 1..=per_piece {
                points.push(self.piece_value(k, width * p as f64 / per_piece as f64, 0));
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_pieces() -> PiecewiseCubic<2> {
        PiecewiseCubic::new(
            vec![1.0, 2.0, 4.0],
            vec![
                [[0.0, 1.0, 0.5, -0.25], [2.0, 0.0, 0.0, 1.0]],
                [[1.25, 1.25, -0.25, 0.0], [3.0, 3.0, 0.0, -0.5]],
            ],
        )
        .unwrap()
    }

    fn near(a: [f64; 2], b: [f64; 2]) {
        assert!(
            (a[0] - b[0]).abs() < 1e-13 && (a[1] - b[1]).abs() < 1e-13,
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn evaluates_each_piece_from_its_own_break() {
        let curve = two_pieces();
        near(curve.evaluate(1.5), [0.5 + 0.125 - 0.031_25, 2.125]);
        near(curve.evaluate(3.0), [2.25, 5.5]);
        near(curve.derivative(3.0, 1), [0.75, 1.5]);
        near(curve.derivative(3.0, 2), [-0.5, -3.0]);
        near(curve.derivative(3.0, 3), [0.0, -3.0]);
        near(curve.end(), curve.evaluate(4.0));
    }

    #[test]
    fn reversal_mirrors_the_parameter() {
        let (curve, back) = (two_pieces(), two_pieces().reversed());
        assert_eq!(back.breaks, [1.0, 3.0, 4.0]);
        for step in 0..=30 {
            let t = 1.0 + 0.1 * f64::from(step);
            near(back.evaluate(t), curve.evaluate(5.0 - t));
            if step % 10 != 0 {
                near(
                    back.derivative(t, 1),
                    curve.derivative(5.0 - t, 1).map(|d| -d),
                );
            }
        }
        assert_eq!(back.start(), curve.end());
    }

    #[test]
    fn restriction_and_split_keep_the_points() {
        let curve = two_pieces();
        let part = curve.restricted(1.5, 3.5).unwrap();
        assert_eq!(part.breaks, [1.5, 2.0, 3.5]);
        for step in 0..=20 {
            let t = 1.5 + 0.1 * f64::from(step);
            near(part.evaluate(t), curve.evaluate(t));
        }
        let (left, right) = curve.split(2.0).unwrap();
        assert_eq!((left.pieces.len(), right.pieces.len()), (1, 1));
        assert!(curve.split(1.0).is_none() && curve.restricted(3.0, 5.0).is_none());
    }

    #[test]
    fn length_of_a_line_and_of_an_arc() {
        let line = PiecewiseCubic::line([0.0, 0.0, 1.0], [2.0, 3.0, 7.0], 7.0).unwrap();
        assert!((line.arc_length() - 7.0).abs() < 1e-12);
        let angle = 0.5;
        let points = [0.0, 1.0, 2.0, 3.0].map(|k: f64| {
            let (sin, cos) = libm::sincos(angle * k / 3.0);
            [10.0 * cos, 10.0 * sin]
        });
        let arc = PiecewiseCubic::through_thirds(0.0, 5.0, &points).unwrap();
        assert!(
            (arc.arc_length() - 5.0).abs() < 1e-4,
            "{}",
            arc.arc_length()
        );
        for (k, point) in points.iter().enumerate() {
            near(arc.evaluate(5.0 * k as f64 / 3.0), *point);
        }
    }

    #[test]
    fn bad_numbers_are_refused() {
        let piece = [[0.0; 4]];
        let refused = |breaks: Vec<f64>, pieces| PiecewiseCubic::<1>::new(breaks, pieces).is_err();
        assert!(refused(vec![0.0], vec![]));
        assert!(refused(vec![0.0, 1.0], vec![]));
        assert!(refused(vec![0.0, 0.0], vec![piece]));
        assert!(refused(vec![0.0, f64::NAN], vec![piece]));
        assert!(refused(
            vec![0.0, 1.0],
            vec![[[f64::INFINITY, 0.0, 0.0, 0.0]]]
        ));
    }
}
