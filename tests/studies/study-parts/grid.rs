//! The trimmed faces of a model against the true part, on a grid of their own over the part: how
//! far they lie off, how much they cover, and which places lie on the wrong side of a trim.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sim_scanner::truth::GraphNode;

use crate::part::Part;
use crate::surface::vector;
use crate::trims::{Place, Trims};
use crate::truth_grid::TruthGrid;

/// A true point is covered where a trimmed face is so near.
pub(crate) const COVERED_MM: f64 = 0.2;

/// Distances of exported surfaces from the true ones.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Deviation {
    pub(crate) nodes: usize,
    pub(crate) squares_mm2: f64,
    pub(crate) most_mm: f64,
    /// Where that is in the x-y plane, and in the face of which region.
    pub(crate) worst: ([f64; 2], u16),
}

impl Deviation {
    fn take(&mut self, off_mm: f64, worst: ([f64; 2], u16)) {
        self.join(&Self {
            nodes: 1,
            squares_mm2: off_mm * off_mm,
            most_mm: off_mm.abs(),
            worst,
        });
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.squares_mm2 += other.squares_mm2;
        if other.most_mm > self.most_mm {
            (self.most_mm, self.worst) = (other.most_mm, other.worst);
        }
    }

    pub(crate) fn rms_mm(&self) -> f64 {
        (self.squares_mm2 / self.nodes as f64).sqrt()
    }
}

/// What a grid says.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct OnGrid {
    /// Away from edges, by true face.
    pub(crate) deviations: BTreeMap<usize, Deviation>,
    /// Nodes whose true point the scanner sees, and those of them that are covered.
    pub(crate) seen: usize,
    pub(crate) covered: usize,
    /// Nodes over the part, or within a trim.
    pub(crate) nodes: usize,
    /// Seen, and outside of all trims.
    pub(crate) lost: usize,
    /// Within a trim, and not over the part.
    pub(crate) invented: usize,
    /// Within a trim of another face than the true one.
    pub(crate) other: usize,
    /// Those of `other` where both faces have been found.
    pub(crate) other_of_found: usize,
    /// The nodes of `other` by true face, the face that it was taken for, and whether they are seen.
    pub(crate) taken: BTreeMap<(usize, Option<usize>, bool), usize>,
}

impl OnGrid {
    pub(crate) fn wrong(&self) -> usize {
        self.lost + self.invented + self.other
    }

    /// The nodes of `other` that are not seen.
    pub(crate) fn other_unseen(&self) -> usize {
        let unseen = self.taken.iter().filter(|((.., is_seen), _)| !is_seen);
        unseen.map(|(_, nodes)| nodes).sum()
    }
}

/// Which true face each region stands for, and the true faces that one region stands for alone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Matched {
    pub(crate) face_of_region: BTreeMap<u16, usize>,
    pub(crate) found_faces: Vec<usize>,
}

/// Holds the trimmed faces of a model against the part.
pub(crate) fn compare(part: &Part, truth: &TruthGrid, trims: &Trims, matched: &Matched) -> OnGrid {
    let mut told = OnGrid::default();
    for (column, row) in TruthGrid::all() {
        let [x, y] = truth.place_mm(column, row);
        let node = truth.node(column, row);
        let at = trims.at(x, y);
        told.side(node, at.as_ref(), matched);
        let Some(node) = node.filter(|node| node.seen) else {
            continue;
        };
        let real = Real { part, node, x, y };
        told.seen += 1;
        told.covered += usize::from(real.is_covered(trims));
        if let Some(at) = at
            && truth.is_away(column, row)
        {
            let off_mm = real.off_mm(&Vector3::new(x, y, at.z_mm));
            let deviation = told.deviations.entry(node.face.face).or_default();
            deviation.take(off_mm, ([x, y], at.region));
        }
    }
    told
}

impl OnGrid {
    /// On which side of the trims a node is. Behind what is seen a face may go on.
    fn side(&mut self, node: Option<&GraphNode>, at: Option<&Place>, matched: &Matched) {
        self.nodes += usize::from(node.is_some() || at.is_some());
        match (node, at) {
            (None, Some(_)) => self.invented += 1,
            (Some(node), None) => self.lost += usize::from(node.seen),
            (Some(node), Some(at)) => {
                let taken_for = matched.face_of_region.get(&at.region);
                if taken_for != Some(&node.face.face) {
                    self.other += 1;
                    let taken = (node.face.face, taken_for.copied(), node.seen);
                    *self.taken.entry(taken).or_default() += 1;
                    let is_found = |face| matched.found_faces.contains(face);
                    let are_found = is_found(&node.face.face) && taken_for.is_some_and(is_found);
                    self.other_of_found += usize::from(are_found);
                }
            }
            (None, None) => {}
        }
    }
}

/// A true point over a node.
struct Real<'a> {
    part: &'a Part,
    node: &'a GraphNode,
    x: f64,
    y: f64,
}

impl Real<'_> {
    /// Distance of a place from the true surface, along its normal.
    fn off_mm(&self, place_mm: &Vector3<f64>) -> f64 {
        let surface = self.part.faces.get(self.node.face.face).copied().flatten();
        surface.map_or_else(
            || (place_mm.z - self.node.z_mm) * self.node.normal.z,
            |surface| surface.distance_mm(place_mm),
        )
    }

    /// Whether a trimmed face is near: over the point, or beside it.
    fn is_covered(&self, trims: &Trims) -> bool {
        const WAYS: usize = 8;
        let point = Vector3::new(self.x, self.y, self.node.z_mm);
        let normal = vector(self.node.normal);
        let is_near = |x: f64, y: f64| {
            trims.at(x, y).is_some_and(|at| {
                let from = Vector3::new(x, y, at.z_mm) - point;
                // Over the point what counts is how far the surface is, not how far up.
                let off_mm = if x == self.x && y == self.y {
                    from.dot(&normal).abs()
                } else {
                    from.norm()
                };
                off_mm <= COVERED_MM
            })
        };
        is_near(self.x, self.y)
            || [0.25, 0.5, 0.75, 0.99].into_iter().any(|share| {
                (0..WAYS).any(|way| {
                    let angle = core::f64::consts::TAU * way as f64 / WAYS as f64;
                    let (sin, cos) = libm::sincos(angle);
                    let reach_mm = share * COVERED_MM;
                    is_near(self.x + reach_mm * cos, self.y + reach_mm * sin)
                })
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trims::tests::square;
    use crate::truth_grid::tests::step;
    use crate::truth_grid::{COLUMNS, ROWS};
    use reconstruct::model::Model;

    fn told(model: &Model) -> OnGrid {
        let (part, truth) = step(2.0);
        let matched = Matched {
            face_of_region: [(1, 0), (2, 1)].into(),
            found_faces: vec![0, 1],
        };
        compare(&part, &truth, &Trims::new(model), &matched)
    }

    fn model(faces: Vec<reconstruct::model::Face>) -> Model {
        Model {
            faces,
            ..Model::default()
        }
    }

    #[test]
    fn the_part_itself_is_right_everywhere() {
        let exact = told(&model(vec![
            square(1, [-10.0, 0.0], 10.0, None, 0.0),
            square(2, [10.0, 0.0], 10.0, None, 2.0),
        ]));
        assert_eq!((exact.nodes, exact.wrong()), (COLUMNS * ROWS, 0));
        assert_eq!(exact.covered, exact.seen);
        assert!(exact.seen > COLUMNS * ROWS * 9 / 10);
        assert!(
            exact
                .deviations
                .values()
                .all(|d| d.most_mm == 0.0 && d.nodes > 10_000)
        );
    }

    #[test]
    fn what_is_off_missing_or_beyond_is_counted() {
        // The lower face 0.1 mm too high; the upper one a millimetre short on one side and half of
        // one on two.
        let off = told(&model(vec![
            square(2, [9.5, 0.0], 9.5, None, 2.0),
            square(1, [-10.5, 0.0], 10.5, None, 0.1),
        ]));
        let lower = off.deviations[&0];
        assert!((lower.rms_mm() - 0.1).abs() < 1e-9 && (lower.most_mm - 0.1).abs() < 1e-9);
        // A strip of 1 mm by 20 mm, and two of 19 mm by 0.5 mm, of 40 mm by 20 mm. The lower one
        // goes beyond the part, where the grid has ended.
        let share = off.lost as f64 / off.nodes as f64;
        assert!((share - 39.0 / 800.0).abs() < 0.005, "{share}");
        assert_eq!((off.other, off.invented), (0, 0));
        // All but 0.2 mm of each strip is not covered.
        let bare = (off.seen - off.covered) as f64 / off.nodes as f64;
        assert!(
            (bare - (20.0 * 0.8 + 19.0 * 0.6) / 800.0).abs() < 0.005,
            "{bare}"
        );
    }

    #[test]
    fn a_border_in_the_wrong_place_is_counted_on_the_other_face() {
        let off = told(&model(vec![
            square(2, [9.0, 0.0], 11.0, None, 2.0),
            square(1, [-10.0, 0.0], 10.0, None, 0.0),
        ]));
        let share = off.other as f64 / off.nodes as f64;
        assert!((share - 2.0 / 40.0).abs() < 0.006, "{share}");
        assert_eq!(off.other, off.other_of_found);
    }
}
