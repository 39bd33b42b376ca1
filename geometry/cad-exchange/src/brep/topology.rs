//! What faces share: vertices, edges, shells.
//!
//! In the model two faces share the path of their border in the x-y plane, and each lifts
//! it onto its own surface. Along a crease the two curves differ by what is left of the
//! noise; there one curve between them is written for both, as far as they are near to
//! each other. Along a step they differ wholly, and each face keeps its own.

use std::collections::BTreeMap;

use nurbs::PiecewiseCubic;
use reconstruct::{Coedge, EdgeKind, Loop, Model};

use super::bend::bent;
use super::corners::Ends;
use super::groups::Groups;
use super::seam::{Nearness, Seam, facing};
use super::support::Support;
use super::{Sharing, onto};
use crate::common::{ROUNDING_PART, SMOOTH_MM, largest, without_kinks};

/// Cosine between z and the normal of a shape along its edges: those that run farther around it than
/// parts are tilted were put on a side that the camera does not see.
const LEAST_FACING: f64 = -0.2;

/// The use of an edge by a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Use {
    /// Index into [`Topology::edges`].
    pub(crate) edge: usize,
    /// The loop runs from the edge's start to its end.
    pub(crate) forward: bool,
}

/// A curve between two vertices, millimetres.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Strand {
    /// Indices into [`Topology::vertices`].
    pub(crate) ends: [usize; 2],
    pub(crate) curve: PiecewiseCubic<3>,
}

impl Strand {
    /// The curve from start to end, or the other way.
    pub(crate) fn directed(&self, forward: bool) -> PiecewiseCubic<3> {
        if forward {
            self.curve.clone()
        } else {
            self.curve.reversed()
        }
    }
}

/// What is written once, however many faces it belongs to.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Topology {
    /// Millimetres.
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) edges: Vec<Strand>,
    /// By face, loop (the outer one first) and coedge.
    pub(crate) uses: Vec<Vec<Vec<Use>>>,
    /// Indices of faces that hang together, each in ascending order.
    pub(crate) shells: Vec<Vec<usize>>,
    /// Edges of two faces.
    pub(crate) shared: usize,
    /// Those of them that are cut where the two curves part.
    pub(crate) partly_shared: usize,
    /// Creases whose two curves are too far apart to be shared.
    pub(crate) parted: usize,
    /// How far a written curve is from what its faces lie on.
    pub(crate) gap_mm: f64,
    /// Of each face, how far its edges are from its shape if it has one; infinite if they are on its
    /// back.
    pub(crate) off_mm: Vec<f64>,
}

impl Topology {
    /// The vertex in which the use of an edge begins.
    pub(super) fn vertex_before(&self, of: Use) -> usize {
        self.edges[of.edge].ends[usize::from(!of.forward)]
    }
}

/// Indices of a face, of a loop of it (the outer one first) and of a coedge of that.
pub(super) type Place = (usize, usize, usize);

/// The topology of a checked model; `supports` are those of its faces, which vertices and edges are
/// put on.
pub(super) fn topology(model: &Model, supports: &[Support<'_>], sharing: Sharing) -> Topology {
    let mut ends = Ends::new(model, supports);
    let (seams, parted) = seams(model, supports, sharing.sharing_mm, &mut ends);
    let corners = ends.corners();
    let mut hung = Groups::new(model.faces.len());
    for (place, seam) in &seams {
        hung.join(place.0, seam.other.0);
    }
    let mut out = Topology {
        vertices: corners.points.clone(),
        shells: hung.groups(),
        shared: seams.len(),
        partly_shared: seams.values().filter(|seam| !seam.is_whole()).count(),
        parted,
        off_mm: vec![0.0; model.faces.len()],
        ..Topology::default()
    };
    let mut builder = Builder {
        out: &mut out,
        supports,
        rounding_mm: ROUNDING_PART * sharing.resolution_mm,
        written: BTreeMap::new(),
    };
    let mut uses = Vec::new();
    for (face, loops) in model.faces.iter().map(loops_of).enumerate() {
        let mut chains = Vec::new();
        for (n, border) in loops.iter().enumerate() {
            let mut chain = Vec::new();
            for (k, coedge) in border.coedges.iter().enumerate() {
                let place = (face, n, k);
                let ends = corners.ends(model, face, coedge);
                chain.extend(builder.coedge(place, &coedge.space_curve, ends, seams.get(&place)));
            }
            chains.push(chain);
        }
        uses.push(chains);
    }
    out.uses = uses;
    out
}

/// The creases whose two curves meet, or whose faces do near them, by the place of their first use,
/// and the number of those that do not. What they share is joined.
fn seams(
    model: &Model,
    supports: &[Support<'_>],
    sharing_mm: f64,
    ends: &mut Ends<'_>,
) -> (BTreeMap<Place, Seam>, usize) {
    let mut seams = BTreeMap::new();
    let mut rest = Vec::new();
    for (place, other) in creases(model) {
        let (Some(first), Some(second)) = (coedge(model, place), coedge(model, other)) else {
            continue;
        };
        let both = [place, other].map(|place| model.faces.get(place.0));
        let facing = |at: [f64; 3]| {
            let of_faces = both.iter().flatten().map(|face| facing(face, at));
            of_faces.fold(0.0, f64::max)
        };
        let (first, second) = (&first.space_curve, &second.space_curve);
        let between = |nearness| Seam::between(first, second, facing, other, nearness);
        match between(Nearness::of(sharing_mm)) {
            Some(seam) if seam.is_whole() => {
                ends.join(place, &seam);
                seams.insert(place, seam);
            }
            partly => {
                let faces = [place.0, other.0].map(|face| supports[face]);
                let whole = Seam::where_they_meet(first, second, &faces, other);
                let farther = between(Nearness::at_most(sharing_mm));
                rest.push((place, whole, farther.or(partly)));
            }
        }
    }
    // Where those that are sure leave it to them.
    let mut parted = 0;
    for (place, whole, partly) in rest {
        let whole = whole.filter(|seam| ends.would_meet(place, seam));
        match whole.or(partly) {
            Some(seam) => {
                ends.join(place, &seam);
                seams.insert(place, seam);
            }
            None => parted += 1,
        }
    }
    (seams, parted)
}

/// Both uses of each crease.
fn creases(model: &Model) -> Vec<(Place, Place)> {
    let crease = |(edge, places): (usize, Vec<Place>)| {
        let &[place, other] = places.as_slice() else {
            return None;
        };
        let is_crease = model.edges.get(edge)?.kind == EdgeKind::Crease;
        let both = [place, other].map(|place| coedge(model, place).map(|of| of.reversed));
        let is_run_both_ways = both[0].is_some() && both[0] != both[1];
        (is_crease && is_run_both_ways).then_some((place, other))
    };
    let edges = places_by_edge(model).into_iter();
    edges.filter_map(crease).collect()
}

/// Writes down strands, shared ones once.
struct Builder<'a> {
    out: &'a mut Topology,
    /// Of each face.
    supports: &'a [Support<'a>],
    rounding_mm: f64,
    /// What the second user of a seam has to know.
    written: BTreeMap<Place, Written>,
}

/// A shared edge as it was written for the first of its faces.
struct Written {
    edge: usize,
    /// Where it begins and ends along the second use, which runs the other way; `None` for
    /// the ends of that.
    mirrored: [Option<f64>; 2],
}

impl Builder<'_> {
    /// The edges of a coedge in its sense of travel: the shared one, where there is one,
    /// and what is left of the face's own curve before and after it.
    fn coedge(
        &mut self,
        place: Place,
        curve: &PiecewiseCubic<3>,
        ends: [usize; 2],
        seam: Option<&Seam>,
    ) -> Vec<Use> {
        let (first, last) = curve.domain();
        let (range, edge, forward) = if let Some(seam) = seam {
            let both = [place.0, seam.other.0].map(|face| self.supports[face]);
            let cut = |whole: bool, vertex: usize, at: [f64; 3], out: &mut Topology| {
                if whole {
                    return vertex;
                }
                let on = onto::point(at, &both);
                out.vertices.push(on.unwrap_or(at));
                out.vertices.len() - 1
            };
            let start = cut(seam.range.0 == first, ends[0], seam.curve.start(), self.out);
            let end = cut(seam.range.1 == last, ends[1], seam.curve.end(), self.out);
            let edge = self.strand(&seam.curve, [start, end], &[place.0, seam.other.0]);
            let mirrored = [
                (seam.range.1 < last).then_some(seam.range.1),
                (seam.range.0 > first).then_some(seam.range.0),
            ]
            .map(|cut| cut.map(|t| first + (last - t)));
            let written = Written { edge, mirrored };
            self.written.insert(seam.other, written);
            (seam.range, edge, true)
        } else if let Some(Written { edge, mirrored }) = self.written.remove(&place) {
            let [from, to] = mirrored;
            ((from.unwrap_or(first), to.unwrap_or(last)), edge, false)
        } else {
            let edge = self.strand(curve, ends, &[place.0]);
            return vec![Use {
                edge,
                forward: true,
            }];
        };
        let shared = Use { edge, forward };
        let mut cuts = self.out.edges[edge].ends;
        if !forward {
            cuts.reverse();
        }
        let mut chain = Vec::new();
        chain.extend(self.rest(place.0, curve, (first, range.0), [ends[0], cuts[0]]));
        chain.push(shared);
        chain.extend(self.rest(place.0, curve, (range.1, last), [cuts[1], ends[1]]));
        chain
    }

    /// The part of a face's own curve between two parameters, if there is one.
    fn rest(
        &mut self,
        face: usize,
        curve: &PiecewiseCubic<3>,
        (from, to): (f64, f64),
        ends: [usize; 2],
    ) -> Option<Use> {
        let part = curve.restricted(from, to)?;
        let edge = self.strand(&part, ends, &[face]);
        Some(Use {
            edge,
            forward: true,
        })
    }

    /// Adds a curve that is led to its vertices and onto the shapes of its faces, and has no kinks
    /// for which readers would split it, and notes how far it is from what these faces lie on.
    fn strand(&mut self, curve: &PiecewiseCubic<3>, ends: [usize; 2], faces: &[usize]) -> usize {
        let [start, end] = ends.map(|vertex| self.out.vertices[vertex]);
        let supports: Vec<Support<'_>> = faces.iter().map(|face| self.supports[*face]).collect();
        // Led first: what is put there with its ends stays there.
        let led = bent(curve, start, end);
        let is_put = supports.iter().any(Support::is_known);
        let on = is_put.then(|| onto::curve(&led, &supports)).flatten();
        let led = on.map_or(led, |on| bent(&on, start, end));
        let curve = without_kinks(&led, SMOOTH_MM, self.rounding_mm);
        for (face, support) in faces.iter().zip(&supports) {
            let off_mm = onto::off(&curve, support);
            self.out.gap_mm = largest([self.out.gap_mm, off_mm]);
            if support.is_known() {
                let is_seen = onto::least_facing(&curve, support) >= LEAST_FACING;
                let of_face = &mut self.out.off_mm[*face];
                *of_face = largest([*of_face, if is_seen { off_mm } else { f64::INFINITY }]);
            }
        }
        self.out.edges.push(Strand { ends, curve });
        self.out.edges.len() - 1
    }
}

pub(super) fn loops_of(face: &reconstruct::Face) -> Vec<&Loop> {
    std::iter::once(&face.outer).chain(&face.inner).collect()
}

pub(super) fn coedge(model: &Model, (face, n, k): Place) -> Option<&Coedge> {
    let face = model.faces.get(face)?;
    loops_of(face).get(n)?.coedges.get(k)
}

/// Where each edge is used, in the order of the faces.
fn places_by_edge(model: &Model) -> BTreeMap<usize, Vec<Place>> {
    let mut places: BTreeMap<usize, Vec<Place>> = BTreeMap::new();
    for (face, loops) in model.faces.iter().map(loops_of).enumerate() {
        for (n, border) in loops.iter().enumerate() {
            for (k, coedge) in border.coedges.iter().enumerate() {
                places.entry(coedge.edge.0).or_default().push((face, n, k));
            }
        }
    }
    places
}
