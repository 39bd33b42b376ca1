//! Where edges end.

use std::collections::BTreeMap;

use reconstruct::{Coedge, Model, VertexId};

use super::groups::Groups;
use super::onto;
use super::seam::Seam;
use super::support::Support;
use super::topology::{Place, coedge, loops_of};

/// Ends of edges. A vertex of the model is a place in the x-y plane; each face has it at
/// a height of its own, and faces that share an edge have it at one.
pub(super) struct Corners {
    /// Number of each vertex as a face has it.
    numbers: BTreeMap<(VertexId, usize), usize>,
    pub(super) points: Vec<[f64; 3]>,
}

impl Corners {
    /// `supports` are those of the faces.
    pub(super) fn new(
        model: &Model,
        seams: &BTreeMap<Place, Seam>,
        supports: &[Support<'_>],
    ) -> Self {
        let mut nodes: BTreeMap<(VertexId, usize), usize> = BTreeMap::new();
        let mut points: Vec<[f64; 3]> = Vec::new();
        for (face, loops) in model.faces.iter().map(loops_of).enumerate() {
            for coedge in loops.iter().flat_map(|border| &border.coedges) {
                let (start, _) = ends(model, coedge);
                nodes.entry((start, face)).or_insert_with(|| {
                    points.push(coedge.space_curve.start());
                    points.len() - 1
                });
            }
        }
        let mut same = Groups::new(points.len());
        for (&place, seam) in seams {
            let Some(coedge) = coedge(model, place) else {
                continue;
            };
            let (start, end) = ends(model, coedge);
            let (first, last) = coedge.space_curve.domain();
            let shared = [(start, seam.range.0 == first), (end, seam.range.1 == last)];
            for (vertex, shared) in shared {
                let node = |face: usize| nodes.get(&(vertex, face));
                if let (true, Some(&a), Some(&b)) = (shared, node(place.0), node(seam.other.0)) {
                    same.join(a, b);
                }
            }
        }
        let groups = same.groups();
        let mut number_of = vec![0; points.len()];
        for (number, group) in groups.iter().enumerate() {
            for &node in group {
                number_of[node] = number;
            }
        }
        let mut of_groups: Vec<Vec<Support<'_>>> = vec![Vec::new(); groups.len()];
        for (&(_, face), &node) in &nodes {
            of_groups[number_of[node]].push(supports[face]);
        }
        let points = groups.iter().zip(&of_groups).map(|(group, of)| {
            let point = middle(group, &points);
            let is_put = of.iter().any(Support::is_shape);
            let on = is_put.then(|| onto::point(point, of)).flatten();
            on.unwrap_or(point)
        });
        Self {
            points: points.collect(),
            numbers: nodes
                .into_iter()
                .map(|(key, node)| (key, number_of[node]))
                .collect(),
        }
    }

    /// The vertices of a face's coedge, in its sense of travel.
    pub(super) fn ends(&self, model: &Model, face: usize, coedge: &Coedge) -> [usize; 2] {
        let (start, end) = ends(model, coedge);
        [start, end].map(|vertex| self.numbers.get(&(vertex, face)).copied().unwrap_or(0))
    }
}

/// Half way between the extremes.
fn middle(group: &[usize], points: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|d| {
        let coordinates = || group.iter().map(|&node| points[node][d]);
        let low = coordinates().fold(f64::INFINITY, f64::min);
        let high = coordinates().fold(f64::NEG_INFINITY, f64::max);
        // A point alone keeps its last digit.
        if low == high { low } else { (low + high) / 2.0 }
    })
}

/// The vertices of a coedge in the sense of travel.
fn ends(model: &Model, coedge: &Coedge) -> (VertexId, VertexId) {
    let edge = &model.edges[coedge.edge.0];
    if coedge.reversed {
        (edge.end, edge.start)
    } else {
        (edge.start, edge.end)
    }
}
