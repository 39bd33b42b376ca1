//! Pieces of one surface that were grown apart.
//!
//! From a small window a cone is a cylinder that leans, and grows as far as that goes: what tells it
//! from a cone are the pieces beside it.

use std::collections::BTreeSet;

use range_image::{Cancelled, Monitor};
use shapes::{Evidence, Sample, decide};

use crate::field::{Field, Set, count, places};
use crate::grow::{Piece, grow};
use crate::join::are_one;
use crate::split::{is_of_one, touching};

/// Samples that are looked at of each piece.
const SAMPLES: usize = 1500;
/// Share of the nodes of both that what they grow to must hold: a piece that has ended on another
/// surface would spoil one that has not.
const HELD: f64 = 0.9;

/// What is known of pieces, in their order.
#[derive(Default)]
pub(crate) struct Known {
    /// Samples of each, and what they speak for.
    told: Vec<(Vec<Sample>, Evidence)>,
    /// Pairs that are not one.
    apart: BTreeSet<(usize, usize)>,
}

impl Known {
    /// Makes one of pieces that touch and are of one shape, which then grows on over what is open.
    /// Pieces that were there before must be the same as then, and come first.
    pub(crate) fn unite(
        &mut self,
        field: &Field<'_>,
        open: &mut [bool],
        pieces: &mut Vec<Piece>,
        monitor: &dyn Monitor,
    ) -> Result<(), Cancelled> {
        let told = |piece: &Piece| -> (Vec<Sample>, Evidence) {
            let samples = field.samples(&piece.nodes, 1, SAMPLES);
            let evidence = decide(&samples, field.area());
            (samples, evidence)
        };
        self.told.extend(pieces[self.told.len()..].iter().map(told));
        while let Some((a, b, both)) = self.next(field, open, pieces, monitor)? {
            for (place, is_in) in both.nodes.iter().enumerate() {
                let was_in = pieces[a].nodes[place] || pieces[b].nodes[place];
                open[place] = (open[place] || was_in) && !is_in;
            }
            self.told[a] = told(&both);
            self.told.remove(b);
            pieces[a] = both;
            pieces.remove(b);
            self.merged(a, b);
        }
        Ok(())
    }

    /// Piece `b` has become a part of `a`, of which nothing is known now but what it is told as.
    fn merged(&mut self, a: usize, b: usize) {
        let is_other = |piece: &usize| *piece != a && *piece != b;
        let others = self
            .apart
            .iter()
            .filter(|(c, d)| is_other(c) && is_other(d));
        let now = |piece: usize| piece - usize::from(piece > b);
        self.apart = others.map(|(c, d)| (now(*c), now(*d))).collect();
    }

    /// The first pair that is of one shape, and what it grows to.
    fn next(
        &mut self,
        field: &Field<'_>,
        open: &[bool],
        pieces: &[Piece],
        monitor: &dyn Monitor,
    ) -> Result<Option<(usize, usize, Piece)>, Cancelled> {
        for (a, b) in touching(field, pieces) {
            monitor.check()?;
            if self.apart.contains(&(a, b)) {
                continue;
            }
            if are_one(&self.told[a], &self.told[b], field.area())
                && let Some(both) = grown(field, open, [&pieces[a], &pieces[b]])
            {
                return Ok(Some((a, b, both)));
            }
            self.apart.insert((a, b));
        }
        Ok(None)
    }
}

/// What two pieces grow to together, where that is one surface, and all but scraps of both.
fn grown(field: &Field<'_>, open: &[bool], pair: [&Piece; 2]) -> Option<Piece> {
    let [a, b] = pair;
    let both: Set = a.nodes.iter().zip(&b.nodes).map(|(a, b)| a | b).collect();
    let free: Set = open
        .iter()
        .zip(&both)
        .map(|(open, own)| open | own)
        .collect();
    let piece = grow(field, &free, &places(&both))?;
    let is_all = count(&piece.nodes) as f64 >= HELD * count(&both) as f64;
    (is_all && is_of_one(field, &piece)).then_some(piece)
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;
    use shapes::{Family, Shape, fit};

    use super::*;
    use crate::testing::Scan;

    /// Wedges of what falls from the middle of the image as told, each taken for a cylinder.
    fn wedges(z_mm: impl Fn(f64, f64) -> f64) -> Vec<Piece> {
        let scan = Scan::of((70, 70), 0.4, 0.05, |x, y| z_mm(x - 14.0, y - 14.0));
        let nodes: Vec<usize> = (0..4900).collect();
        let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
        let place = |place: usize| {
            let (column, row) = (place / field.rows(), place % field.rows());
            (scan.image.x_mm(column) - 14.0, scan.image.y_mm(row) - 14.0)
        };
        let is_on = |at: usize| {
            let (x, y) = place(at);
            (7.0..13.0).contains(&libm::sqrt(x * x + y * y))
        };
        let wedge = |k: i32| {
            let is_in = |at: usize| {
                let (x, y) = place(at);
                let turn = libm::atan2(y, x) * 4.0 / core::f64::consts::PI;
                is_on(at) && (libm::floor(turn) as i32).rem_euclid(8) == k
            };
            let nodes: Set = (0..field.len()).map(is_in).collect();
            let fit = fit(Family::Cylinder, &field.samples(&nodes, 0, SAMPLES), 1.0);
            assert!(fit.is_some());
            Piece { fit, nodes }
        };
        let mut pieces: Vec<Piece> = (0..8).map(wedge).collect();
        let mut open = vec![false; field.len()];
        let mut known = Known::default();
        let united = known.unite(&field, &mut open, &mut pieces, &Unmonitored);
        united.unwrap();
        pieces
    }

    #[test]
    fn pairs_that_are_apart_stay_so_but_for_those_of_what_has_grown() {
        let mut known = Known {
            apart: [(0, 1), (0, 2), (0, 3), (1, 2), (2, 4), (3, 4)].into(),
            ..Known::default()
        };
        known.merged(1, 3);
        assert_eq!(known.apart, [(0, 2), (2, 3)].into());
    }

    #[test]
    fn wedges_of_a_cone_are_one() {
        let pieces = wedges(|x, y| -1.1 * libm::sqrt(x * x + y * y));
        assert_eq!(pieces.len(), 1);
        let shape = pieces[0].fit.as_ref().unwrap().shape;
        assert!(
            matches!(shape, Shape::Cone(c) if (libm::tan(c.half_angle_rad) * 1.1 - 1.0).abs() < 0.05),
            "{shape:?}"
        );
    }

    #[test]
    fn the_faces_of_a_pyramid_stay_apart() {
        let pieces = wedges(|x, y| -1.1 * (x.abs().max(y.abs())));
        // Each face was cut in two.
        assert_eq!(pieces.len(), 4);
    }
}
