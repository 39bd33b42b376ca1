//! Where edges end.

use std::collections::BTreeMap;

use reconstruct::{Coedge, Model, VertexId};

use super::bend::{apart, length_mm};
use super::groups::Groups;
use super::onto;
use super::seam::Seam;
use super::support::Support;
use super::topology::{Place, coedge, loops_of};

/// Faces that meet but for this, millimetres, have a corner: their edges are led to it.
const CORNER_MM: f64 = 0.03;

/// A corner is moved by no more than this share of the shortest edge that ends there: farther, and
/// what is short folds back across its neighbours.
const SHARE_OF_EDGE: f64 = 0.25;

/// Ends of edges. A vertex of the model is a place in the x-y plane; each face has it at
/// a height of its own, and faces that share an edge have it at one.
pub(super) struct Corners {
    /// Number of each vertex as a face has it.
    numbers: BTreeMap<(VertexId, usize), usize>,
    pub(super) points: Vec<[f64; 3]>,
}

/// Ends of edges while it is found out which are one.
pub(super) struct Ends<'a> {
    model: &'a Model,
    supports: &'a [Support<'a>],
    nodes: BTreeMap<(VertexId, usize), usize>,
    points: Vec<[f64; 3]>,
    /// The length of the shortest edge that ends in each, millimetres.
    shortest_mm: Vec<f64>,
    same: Groups,
}

impl<'a> Ends<'a> {
    /// Each for itself; `supports` are those of the faces.
    pub(super) fn new(model: &'a Model, supports: &'a [Support<'a>]) -> Self {
        let mut nodes: BTreeMap<(VertexId, usize), usize> = BTreeMap::new();
        let mut points: Vec<[f64; 3]> = Vec::new();
        let coedges = || {
            let of_faces = model.faces.iter().map(loops_of).enumerate();
            let loops =
                of_faces.flat_map(|(face, loops)| loops.into_iter().map(move |l| (face, l)));
            loops.flat_map(|(face, border)| border.coedges.iter().map(move |c| (face, c)))
        };
        for (face, coedge) in coedges() {
            let (start, _) = ends(model, coedge);
            nodes.entry((start, face)).or_insert_with(|| {
                points.push(coedge.space_curve.start());
                points.len() - 1
            });
        }
        let mut shortest_mm = vec![f64::INFINITY; points.len()];
        for (face, coedge) in coedges() {
            let own_mm = length_mm(&coedge.space_curve);
            let (start, end) = ends(model, coedge);
            for node in [start, end].iter().filter_map(|at| nodes.get(&(*at, face))) {
                shortest_mm[*node] = shortest_mm[*node].min(own_mm);
            }
        }
        Self {
            same: Groups::new(points.len()),
            model,
            supports,
            nodes,
            points,
            shortest_mm,
        }
    }

    /// The ends that a seam makes one: where it is, and as its two faces have it.
    fn joints(&self, place: Place, seam: &Seam) -> Vec<([f64; 3], [usize; 2])> {
        let Some(coedge) = coedge(self.model, place) else {
            return Vec::new();
        };
        let (start, end) = ends(self.model, coedge);
        let (first, last) = coedge.space_curve.domain();
        let both = [
            (start, seam.curve.start(), seam.range.0 == first),
            (end, seam.curve.end(), seam.range.1 == last),
        ];
        let shared = both.into_iter().filter(|(_, _, is_shared)| *is_shared);
        let joint = |(vertex, at, _): (VertexId, [f64; 3], bool)| {
            let node = |face: usize| self.nodes.get(&(vertex, face)).copied();
            Some((at, [node(place.0)?, node(seam.other.0)?]))
        };
        shared.filter_map(joint).collect()
    }

    /// Makes the ends of a seam one for both its faces.
    pub(super) fn join(&mut self, place: Place, seam: &Seam) {
        for (_, [a, b]) in self.joints(place, seam) {
            self.same.join(a, b);
        }
    }

    /// Whether at both ends of a seam all the faces that would share it have a point in common.
    pub(super) fn would_meet(&self, place: Place, seam: &Seam) -> bool {
        self.joints(place, seam).into_iter().all(|(at, joined)| {
            let is_of = |node: usize| joined.iter().any(|of| self.same.are_joined(*of, node));
            let of = self.nodes.iter().filter(|(_, node)| is_of(**node));
            let of: Vec<Support<'_>> = of.map(|((_, face), _)| self.supports[*face]).collect();
            onto::point(at, &of).is_some_and(|at| onto::farthest(at, &of) <= CORNER_MM)
        })
    }

    /// The ends as they have come to be.
    pub(super) fn corners(self) -> Corners {
        let supports = self.supports;
        let groups = self.same.groups();
        let mut number_of = vec![0; self.points.len()];
        for (number, group) in groups.iter().enumerate() {
            for &node in group {
                number_of[node] = number;
            }
        }
        let mut of_groups: Vec<Vec<Support<'_>>> = vec![Vec::new(); groups.len()];
        for (&(_, face), &node) in &self.nodes {
            of_groups[number_of[node]].push(supports[face]);
        }
        let points = groups.iter().zip(&of_groups).map(|(group, of)| {
            let point = middle(group, &self.points);
            // Where not all meet, those that are known best.
            let shapes: Vec<Support<'_>> = of.iter().copied().filter(Support::is_known).collect();
            let common = onto::point(point, of).filter(|at| onto::farthest(*at, of) <= CORNER_MM);
            let common = common.or_else(|| onto::point(point, &shapes));
            let shortest_mm = group.iter().map(|node| self.shortest_mm[*node]);
            let most_mm = SHARE_OF_EDGE * shortest_mm.fold(f64::INFINITY, f64::min);
            common
                .filter(|at| apart(*at, point) <= most_mm)
                .unwrap_or(point)
        });
        Corners {
            points: points.collect(),
            numbers: self
                .nodes
                .into_iter()
                .map(|(key, node)| (key, number_of[node]))
                .collect(),
        }
    }
}

impl Corners {
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

#[cfg(test)]
mod tests {
    use super::super::seam::Nearness;
    use super::*;
    use nalgebra::Vector3;
    use nurbs::{PatchSurface, PiecewiseCubic};
    use reconstruct::{Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Surface, Vertex};
    use shapes::{Plane, Shape};

    const TIPS: [[f64; 2]; 4] = [[9.0, 0.0], [0.0, 9.0], [-9.0, 0.0], [0.0, -9.0]];

    /// Four faces around a vertex, as far as their ends go: each between one crease and the next. The
    /// last crease is so long, the others 9 mm.
    fn roof(last_mm: f64) -> Model {
        let line = |k: usize| {
            let length_mm = if k == 3 { last_mm } else { 9.0 };
            let tip = TIPS[k].map(|of| of * length_mm / 9.0);
            PiecewiseCubic::line([0.0; 2], tip, length_mm).unwrap()
        };
        let edge = |k: usize| Edge {
            start: VertexId(0),
            end: VertexId(k + 1),
            kind: EdgeKind::Crease,
            origin: EdgeOrigin::Intersected,
            path: line(k),
        };
        let coedge = |k: usize, reversed: bool| {
            let path = if reversed {
                line(k).reversed()
            } else {
                line(k)
            };
            let pieces = path.pieces.iter().map(|[x, y]| [*x, *y, [0.0; 4]]);
            let space_curve = PiecewiseCubic::new(path.breaks.clone(), pieces.collect()).unwrap();
            Coedge {
                edge: EdgeId(k),
                reversed,
                parameter_curve: path,
                space_curve,
            }
        };
        let flat = || {
            let side = vec![-9.0, 9.0];
            PatchSurface::through_thirds(side.clone(), side, |_, _| 0.0).unwrap()
        };
        let face = |k: usize| Face {
            name: format!("Face {k}"),
            region: 1,
            surface: Surface::Patches(flat()),
            form: None,
            outer: Loop {
                coedges: vec![coedge(k, false), coedge((k + 1) % 4, true)],
            },
            inner: Vec::new(),
        };
        let places = core::iter::once([0.0; 2]).chain(TIPS);
        Model {
            vertices: places.map(|[x_mm, y_mm]| Vertex { x_mm, y_mm }).collect(),
            edges: (0..4).map(edge).collect(),
            faces: (0..4).map(face).collect(),
        }
    }

    #[test]
    fn a_crease_joins_a_corner_if_its_faces_meet_there() {
        let model = roof(9.0);
        let would_meet = |raised_mm: f64| {
            let plane = |k: usize| {
                let [x, y] = TIPS[k];
                Support::Shape(Shape::Plane(Plane {
                    point_mm: Vector3::new(0.0, 0.0, if k == 3 { raised_mm } else { 0.0 }),
                    normal: Vector3::new(x, y, 9.0).normalize(),
                }))
            };
            let supports: Vec<Support<'_>> = (0..4).map(plane).collect();
            let mut ends = Ends::new(&model, &supports);
            // The crease that face k has last, and the next one first.
            let seam = |k: usize| {
                let (place, other) = ((k, 0, 1), (k + 1, 0, 0));
                let curve = |at: Place| &coedge(&model, at).unwrap().space_curve;
                let seam = Seam::between(
                    curve(place),
                    curve(other),
                    |_| 1.0,
                    other,
                    Nearness::of(0.1),
                );
                (place, seam.unwrap())
            };
            for k in [0, 1] {
                let (place, seam) = seam(k);
                assert!(ends.would_meet(place, &seam), "three planes do");
                ends.join(place, &seam);
            }
            let (place, seam) = seam(2);
            ends.would_meet(place, &seam)
        };
        assert!(would_meet(0.0) && would_meet(0.1));
        assert!(!would_meet(0.3));
    }

    #[test]
    fn a_corner_is_not_led_farther_than_a_quarter_of_its_shortest_edge() {
        let moved_mm = |last_mm: f64| {
            let model = roof(last_mm);
            let plane = |k: usize| {
                let [x, y] = TIPS[k];
                Support::Shape(Shape::Plane(Plane {
                    point_mm: Vector3::new(0.5, 0.0, 0.0),
                    normal: Vector3::new(x, y, 9.0).normalize(),
                }))
            };
            let supports: Vec<Support<'_>> = (0..4).map(plane).collect();
            let mut ends = Ends::new(&model, &supports);
            for k in 0..3 {
                let (place, other) = ((k, 0, 1), (k + 1, 0, 0));
                let curve = |at: Place| &coedge(&model, at).unwrap().space_curve;
                let near = Nearness::of(0.1);
                let seam = Seam::between(curve(place), curve(other), |_| 1.0, other, near);
                ends.join(place, &seam.unwrap());
            }
            let corners = ends.corners();
            let first = &model.faces[0].outer.coedges[0];
            corners.points[corners.ends(&model, 0, first)[0]][0]
        };
        assert!((moved_mm(9.0) - 0.5).abs() < 1e-9);
        assert!((moved_mm(2.1) - 0.5).abs() < 1e-9);
        assert_eq!(moved_mm(1.9), 0.0);
    }
}
