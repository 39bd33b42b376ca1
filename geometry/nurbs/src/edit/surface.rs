//! What is done to surfaces: what is done to curves, whose points are rows of the control net.

use super::polygon::Polygon;
use super::remove::{Removal, View, removed};
use super::{elevate, refine};
use crate::knots::{KnotError, KnotVector, MAX_DEGREE};
use crate::surface::BSplineSurface;
use crate::uniform::Parameter;

impl<const D: usize> BSplineSurface<D> {
    fn knots(&self, along: Parameter) -> &KnotVector {
        match along {
            Parameter::U => self.u_knots(),
            Parameter::V => self.v_knots(),
        }
    }

    /// The surface as a curve along one parameter.
    fn polygon(&self, along: Parameter) -> Polygon {
        let (columns, rows) = (
            self.u_knots().control_count(),
            self.v_knots().control_count(),
        );
        let points = match along {
            Parameter::U => self.points().concat(),
            Parameter::V => {
                let by_row = (0..rows).flat_map(|j| (0..columns).map(move |i| i * rows + j));
                by_row.flat_map(|k| self.points()[k]).collect()
            }
        };
        let width = D * match along {
            Parameter::U => rows,
            Parameter::V => columns,
        };
        Polygon::new(self.knots(along), width, points)
    }

    fn of(&self, polygon: Polygon, along: Parameter) -> Self {
        let count = polygon.count();
        let knots = KnotVector::assembled(polygon.degree, polygon.knots);
        let places = polygon.points.chunks_exact(D);
        let places: Vec<[f64; D]> = places.map(|p| core::array::from_fn(|d| p[d])).collect();
        match along {
            Parameter::U => Self::assembled(knots, self.v_knots().clone(), places),
            Parameter::V => {
                let columns = self.u_knots().control_count();
                let by_column = (0..columns).flat_map(|i| (0..count).map(move |j| j * columns + i));
                let points = by_column.map(|k| places[k]).collect();
                Self::assembled(self.u_knots().clone(), knots, points)
            }
        }
    }

    /// The same surface with more knots along a parameter (Piegl & Tiller 1997, section 5.3).
    ///
    /// # Errors
    /// [`KnotError`] where one lies outside, or would come more often than the degree.
    pub fn with_knots(&self, along: Parameter, more: &[f64]) -> Result<Self, KnotError> {
        let knots = refine::with(self.knots(along), more)?;
        let polygon = self.polygon(along).over(knots.knots().to_vec());
        Ok(self.of(polygon, along))
    }

    /// The surface without one of its inner knots along a parameter, which is removed once, and by
    /// how much that moves it (Piegl & Tiller 1997, section 5.4). `None` where there is no such knot
    /// inside.
    #[must_use]
    pub fn without_knot(&self, along: Parameter, knot: f64) -> Option<Removal<Self>> {
        let polygon = self.polygon(along);
        let view = View {
            knots: self.knots(along),
            width: polygon.width,
            points: &polygon.points,
        };
        let removal = removed(&view, knot, D)?;
        Some(Removal {
            left: self.of(removal.left, along),
            moved: removal.moved,
            function: removal.function,
        })
    }

    /// The same surface, one degree higher along a parameter. `None` at [`MAX_DEGREE`].
    #[must_use]
    pub fn elevated(&self, along: Parameter) -> Option<Self> {
        let is_possible = self.knots(along).degree() < MAX_DEGREE;
        is_possible.then(|| self.of(elevate::elevated(&self.polygon(along)), along))
    }

    /// The parts before and after a parameter. `None` where it is not inside the domain.
    #[must_use]
    pub fn split(&self, along: Parameter, t: f64) -> Option<(Self, Self)> {
        let (before, after) = refine::halves(&self.polygon(along), t)?;
        Some((self.of(before, along), self.of(after, along)))
    }

    /// The polynomial pieces, as Bezier patches, those of the first span in u first.
    #[must_use]
    pub fn bezier_patches(&self) -> Vec<Self> {
        let strips = refine::pieces(&self.polygon(Parameter::U)).into_iter();
        let strips = strips.map(|strip| self.of(strip, Parameter::U));
        let patches = strips.flat_map(|strip| {
            let of_strip = refine::pieces(&strip.polygon(Parameter::V)).into_iter();
            let of_strip = of_strip.map(|piece| strip.of(piece, Parameter::V));
            of_strip.collect::<Vec<_>>()
        });
        patches.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> BSplineSurface {
        let u = KnotVector::new(3, vec![0., 0., 0., 0., 1., 2.5, 4., 4., 4., 4.]).unwrap();
        let v = KnotVector::new(2, vec![-1., -1., -1., 0., 0.5, 2., 2., 2.]).unwrap();
        let points = (0..30).map(|k| {
            let (i, j) = (f64::from(k / 5), f64::from(k % 5));
            [i, j + 0.1 * i, f64::from(k * k % 13) * 0.2]
        });
        BSplineSurface::new(u, v, points.collect()).unwrap()
    }

    fn farthest(a: &BSplineSurface, b: &BSplineSurface) -> f64 {
        let (u, v) = (b.u_knots().domain(), b.v_knots().domain());
        let mut most = 0.0_f64;
        for i in 0..=20 {
            for j in 0..=20 {
                let s = u.0 + (u.1 - u.0) * f64::from(i) / 20.0;
                let t = v.0 + (v.1 - v.0) * f64::from(j) / 20.0;
                let (p, q) = (a.evaluate(s, t), b.evaluate(s, t));
                let off = (0..3).map(|d| (p[d] - q[d]) * (p[d] - q[d])).sum::<f64>();
                most = most.max(off.sqrt());
            }
        }
        most
    }

    #[test]
    fn other_ways_to_write_it_are_the_same_surface() {
        let surface = wavy();
        for (along, knot, inside) in [(Parameter::U, 1.7, 2.5), (Parameter::V, 0.25, 0.5)] {
            let finer = surface.with_knots(along, &[knot, inside]).unwrap();
            assert!(farthest(&surface, &finer) < 1e-12);
            assert!(farthest(&surface, &surface.elevated(along).unwrap()) < 1e-12);
            let removal = finer.without_knot(along, knot).unwrap();
            let removal = removal.left.without_knot(along, inside).unwrap();
            assert!(removal.moved < 1e-10 && farthest(&surface, &removal.left) < 1e-10);
            let (before, after) = surface.split(along, knot).unwrap();
            assert!(farthest(&surface, &before) < 1e-12 && farthest(&surface, &after) < 1e-12);
        }
        let patches = surface.bezier_patches();
        assert_eq!(patches.len(), 9);
        for patch in patches {
            assert_eq!(patch.points().len(), 12);
            assert!(farthest(&surface, &patch) < 1e-12);
        }
    }

    #[test]
    fn a_knot_removed_moves_no_point_farther_than_is_said() {
        let surface = wavy();
        for (along, knot) in [(Parameter::U, 1.0), (Parameter::V, 0.5)] {
            let removal = surface.without_knot(along, knot).unwrap();
            let moved = farthest(&surface, &removal.left);
            assert!(
                moved > 0.1 * removal.moved && moved <= removal.moved,
                "{moved}"
            );
        }
    }
}
