//! What is done to curves.

use super::polygon::Polygon;
use super::remove::{Removal, View, bound, removed};
use super::{elevate, refine};
use crate::curve::BSplineCurve;
use crate::knots::{KnotError, KnotVector, MAX_DEGREE};

impl<const D: usize> BSplineCurve<D> {
    fn polygon(&self) -> Polygon {
        Polygon::new(self.knots(), D, self.points().concat())
    }

    fn view(&self) -> View<'_> {
        View {
            knots: self.knots(),
            width: D,
            points: self.points().as_flattened(),
        }
    }

    fn of(polygon: Polygon) -> Self {
        let places = polygon.points.chunks_exact(D);
        let points = places
            .map(|place| core::array::from_fn(|d| place[d]))
            .collect();
        Self::assembled(KnotVector::assembled(polygon.degree, polygon.knots), points)
    }

    /// The same curve with more knots (Piegl & Tiller 1997, section 5.3).
    ///
    /// # Errors
    /// [`KnotError`] where one lies outside, or would come more often than the degree.
    pub fn with_knots(&self, more: &[f64]) -> Result<Self, KnotError> {
        let knots = refine::with(self.knots(), more)?;
        Ok(Self::of(self.polygon().over(knots.knots().to_vec())))
    }

    /// The curve without one of its inner knots, which is removed once, and by how much that moves
    /// it (Piegl & Tiller 1997, algorithm A5.8). `None` where there is no such knot inside.
    #[must_use]
    pub fn without_knot(&self, knot: f64) -> Option<Removal<Self>> {
        let removal = removed(&self.view(), knot, D)?;
        Some(Removal {
            left: Self::of(removal.left),
            moved: removal.moved,
            function: removal.function,
        })
    }

    /// By how much [`Self::without_knot`] would move the curve, and which function carries that:
    /// no point is moved by more than its value times this. `None` where there is no such knot
    /// inside.
    #[must_use]
    pub fn removal_bound(&self, knot: f64) -> Option<(f64, usize)> {
        bound(&self.view(), knot, D)
    }

    /// The same curve, one degree higher (Piegl & Tiller 1997, section 5.5). `None` at
    /// [`MAX_DEGREE`].
    #[must_use]
    pub fn elevated(&self) -> Option<Self> {
        let is_possible = self.knots().degree() < MAX_DEGREE;
        is_possible.then(|| Self::of(elevate::elevated(&self.polygon())))
    }

    /// The parts before and after a parameter. `None` where it is not inside the domain.
    #[must_use]
    pub fn split(&self, t: f64) -> Option<(Self, Self)> {
        let (before, after) = refine::halves(&self.polygon(), t)?;
        Some((Self::of(before), Self::of(after)))
    }

    /// The polynomial pieces, as Bezier curves: their knots are those of their ends alone.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<Self> {
        refine::pieces(&self.polygon())
            .into_iter()
            .map(Self::of)
            .collect()
    }

    /// A closed curve over a clamped knot vector from one over a periodic one: `points[i]` belongs
    /// to the function over `degree + 2` of the breaks from the `i`-th on, which go on from the last
    /// to the first. The last break is the first one a period later.
    ///
    /// # Errors
    /// [`KnotError`] where the breaks do not ascend, or the degree is none.
    ///
    /// # Panics
    /// When there are not as many points as spans.
    pub fn periodic(degree: usize, breaks: &[f64], points: &[[f64; D]]) -> Result<Self, KnotError> {
        let spans = breaks.len().saturating_sub(1);
        assert_eq!(points.len(), spans, "a point for each span");
        let [first, last] = [breaks.first(), breaks.last()].map(|b| b.copied().unwrap_or(0.0));
        let clamped = [vec![first; degree], breaks.to_vec(), vec![last; degree]];
        let clamped = KnotVector::new(degree, clamped.concat())?;
        // Break k of the endless sequence.
        let at = |k: isize| {
            let turns = k.div_euclid(spans as isize);
            breaks[k.rem_euclid(spans as isize) as usize] + turns as f64 * (last - first)
        };
        let from = -(degree as isize);
        let to = (spans + degree) as isize;
        let around = from..to - degree as isize;
        let wrapped = around.map(|i| points[i.rem_euclid(spans as isize) as usize]);
        let periodic = Polygon {
            degree,
            knots: (from..=to).map(at).collect(),
            width: D,
            points: wrapped.flatten().collect(),
        };
        Ok(Self::of(periodic.over(clamped.knots().to_vec())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic() -> BSplineCurve<2> {
        let knots = vec![0., 0., 0., 0., 1., 1., 2.5, 3., 4., 4., 4., 4.];
        let points = (0..8).map(|k| [f64::from(k), f64::from(k * k * 3 % 7)]);
        BSplineCurve::new(KnotVector::new(3, knots).unwrap(), points.collect()).unwrap()
    }

    fn farthest(a: &BSplineCurve<2>, b: &BSplineCurve<2>) -> f64 {
        let (first, last) = b.knots().domain();
        let off = (0..=400).map(|k| {
            let t = first + (last - first) * f64::from(k) / 400.0;
            let (p, q) = (a.evaluate(t), b.evaluate(t));
            libm::hypot(p[0] - q[0], p[1] - q[1])
        });
        off.fold(0.0, f64::max)
    }

    #[test]
    fn knots_inserted_leave_the_curve_as_it_is_and_are_removed_again() {
        let curve = cubic();
        let finer = curve.with_knots(&[0.25, 1.0, 2.5, 3.7, 3.7]).unwrap();
        assert_eq!(finer.points().len(), curve.points().len() + 5);
        assert!(farthest(&curve, &finer) < 1e-12);
        let mut back = finer;
        for knot in [3.7, 0.25, 1.0, 3.7, 2.5] {
            let removal = back.without_knot(knot).unwrap();
            assert!(removal.moved < 1e-10, "{knot} {}", removal.moved);
            back = removal.left;
        }
        assert_eq!(back.knots(), curve.knots());
        assert!(farthest(&curve, &back) < 1e-10);
        assert!(curve.with_knots(&[4.5]).is_err() && curve.with_knots(&[1.0, 1.0]).is_err());
    }

    #[test]
    fn a_knot_removed_moves_the_curve_by_no_more_than_is_said() {
        let curve = cubic();
        for knot in [1.0, 2.5, 3.0] {
            let removal = curve.without_knot(knot).unwrap();
            let bound = (removal.moved, removal.function);
            assert_eq!(curve.removal_bound(knot), Some(bound));
            let moved = farthest(&curve, &removal.left);
            assert!(
                moved > 0.1 * removal.moved && moved <= removal.moved,
                "{knot} {moved}"
            );
            // And everywhere by no more than the function that carries it allows.
            for k in 0..=400 {
                let t = 0.01 * f64::from(k);
                let basis = curve.knots().basis(t);
                let own = removal.function.checked_sub(basis.first);
                let value = own
                    .filter(|own| *own <= 3)
                    .map_or(0.0, |own| basis.values[own]);
                let (p, q) = (curve.evaluate(t), removal.left.evaluate(t));
                let off = libm::hypot(p[0] - q[0], p[1] - q[1]);
                assert!(off <= value * removal.moved + 1e-12, "{knot} at {t}");
            }
        }
        assert!(curve.without_knot(0.0).is_none() && curve.without_knot(0.7).is_none());
    }

    #[test]
    fn a_higher_degree_is_the_same_curve() {
        let curve = cubic();
        let higher = curve.elevated().unwrap();
        assert_eq!(higher.knots().degree(), 4);
        assert!(farthest(&curve, &higher) < 1e-12);
        // An inner corner stays as sharp: the double knot comes three times.
        let times = higher.knots().knots().iter().filter(|k| **k == 1.0).count();
        assert_eq!(times, 3);
    }

    #[test]
    fn parts_and_pieces_are_the_curve() {
        let curve = cubic();
        for t in [0.5, 1.0, 2.5, 3.2] {
            let (before, after) = curve.split(t).unwrap();
            assert_eq!(
                (before.knots().domain(), after.knots().domain()),
                ((0.0, t), (t, 4.0))
            );
            assert!(farthest(&curve, &before) < 1e-12 && farthest(&curve, &after) < 1e-12);
        }
        assert!(curve.split(0.0).is_none() && curve.split(f64::NAN).is_none());
        let pieces = curve.bezier_pieces();
        assert_eq!(pieces.len(), 4);
        for piece in pieces {
            assert_eq!(piece.points().len(), 4);
            assert!(farthest(&curve, &piece) < 1e-12);
        }
    }

    #[test]
    fn a_periodic_curve_goes_on_smoothly_over_its_seam() {
        let breaks = [0.0, 0.7, 1.0, 2.1, 2.6, 3.5];
        let points = [
            [1.0, 0.0],
            [0.0, 2.0],
            [-1.5, 0.3],
            [-1.0, -1.0],
            [0.5, -1.2],
        ];
        let curve = BSplineCurve::periodic(3, &breaks, &points).unwrap();
        assert_eq!(curve.points().len(), 8);
        for order in 0..=2 {
            let (start, end) = (curve.derivative(0.0, order), curve.derivative(3.5, order));
            for d in 0..2 {
                assert!(
                    (start[d] - end[d]).abs() < 1e-10,
                    "{order}: {start:?} {end:?}"
                );
            }
        }
        // On even breaks it is the closed form of the uniform cubic: (1, 4, 1) / 6 at a knot.
        let even = BSplineCurve::periodic(3, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], &points).unwrap();
        // The function over breaks i to i + 4 has its middle at break i + 2.
        let at = even.evaluate(3.0);
        for d in 0..2 {
            let expected = (points[0][d] + 4.0 * points[1][d] + points[2][d]) / 6.0;
            assert!((at[d] - expected).abs() < 1e-12);
        }
    }
}
