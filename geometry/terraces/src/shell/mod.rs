//! From cells and heights to faces that share their edges.
//!
//! Every cell gives a face on top and one at the bottom, every edge between different heights a
//! wall; then what lies on one surface is joined, and edges that go on in one curve are.

mod merge;
mod walls;

use crate::arrange::Torn;
use crate::field::Field;
use crate::height::Height;
use crate::plan::{P2, Support, distance, positive};

/// Heights at a place, or along an edge, that are nearer than this are one, millimetres.
pub(crate) const MEET_MM: f64 = 1e-5;

/// Edges keep as far from tips within a face, millimetres.
const TIP_MM: f64 = 0.04;

/// The parameter of a support nearest to a place, from a first one on.
fn foot(on: &Support, from: f64, at: P2) -> f64 {
    match on {
        Support::Line { .. } => on.parameter(at),
        Support::Circle { .. } => from + positive(on.parameter(at) - from),
    }
}

/// What a face lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Key {
    Top(usize),
    Bottom,
    /// Over a support; the material is on its left.
    Wall {
        support: usize,
        material_left: bool,
    },
}

/// Where an edge runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Path {
    /// Over a stretch of a support, at the height of a surface; the other that meets it there.
    Over {
        support: usize,
        from: f64,
        to: f64,
        heights: [usize; 2],
        is_seam: bool,
    },
    /// Upright at a vertex of the plan.
    Upright { vertex: usize },
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub(crate) path: Path,
    pub(crate) ends: [usize; 2],
    pub(crate) is_alive: bool,
}

/// An edge as it bounds a face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Use {
    pub(crate) edge: usize,
    pub(crate) forward: bool,
    pub(crate) face: usize,
    pub(crate) next: usize,
    pub(crate) before: usize,
}

#[derive(Debug, Clone)]
pub(crate) struct Vertex {
    pub(crate) plan: usize,
    pub(crate) z: f64,
}

/// A face with where it came from: a cell, or an edge of the plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    pub(crate) key: Key,
    pub(crate) source: usize,
}

/// Faces, edges and vertices; joined faces are told by `parent`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shell {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) faces: Vec<Face>,
    pub(crate) uses: Vec<Use>,
    /// Uses of each edge.
    pub(crate) of_edge: Vec<Vec<usize>>,
    pub(crate) parent: Vec<usize>,
}

impl Shell {
    pub(crate) fn new(field: &Field, heights: &[Height]) -> Result<Self, Torn> {
        let mut shell = walls::raise(field, heights)?;
        merge::join(&mut shell, field, heights);
        shell.tips(field)?;
        Ok(shell)
    }

    /// Fails where an edge passes so near to a tip, which a face has within it, that readers take
    /// the edge for crossing itself.
    fn tips(&self, field: &Field) -> Result<(), Torn> {
        let mut ends = vec![0; self.vertices.len()];
        for edge in self.edges.iter().filter(|edge| edge.is_alive) {
            edge.ends.iter().for_each(|&end| ends[end] += 1);
        }
        for (vertex, _) in ends.iter().enumerate().filter(|(_, count)| **count == 1) {
            let plan = &field.plan;
            let tip = plan.vertices[self.vertices[vertex].plan];
            for edge in self.edges.iter().filter(|edge| edge.is_alive) {
                let Path::Over {
                    support, from, to, ..
                } = edge.path
                else {
                    continue;
                };
                let on = plan.supports[support];
                let near = [from, to, foot(&on, from, tip)].map(|t| t.clamp(from, to));
                let near = near.map(|t| on.at(t)).into_iter();
                let mut near = near.filter(|_| !edge.ends.contains(&vertex));
                if let Some(at) = near.find(|&at| distance(at, tip) < TIP_MM) {
                    return Err(Torn { at });
                }
            }
        }
        Ok(())
    }

    pub(crate) fn root(&self, face: usize) -> usize {
        let mut at = face;
        while self.parent[at] != at {
            at = self.parent[at];
        }
        at
    }

    pub(crate) fn start(&self, of: &Use) -> usize {
        self.edges[of.edge].ends[usize::from(!of.forward)]
    }

    /// The loops of each joined face that is left, by its root.
    pub(crate) fn loops(&self) -> Vec<(usize, Vec<Vec<usize>>)> {
        let mut loops: Vec<Vec<Vec<usize>>> = vec![Vec::new(); self.faces.len()];
        let mut is_done = vec![false; self.uses.len()];
        for first in 0..self.uses.len() {
            if !self.edges[self.uses[first].edge].is_alive || is_done[first] {
                continue;
            }
            let mut run = Vec::new();
            let mut at = first;
            while !is_done[at] {
                is_done[at] = true;
                run.push(at);
                at = self.uses[at].next;
            }
            loops[self.root(self.uses[first].face)].push(run);
        }
        let all = loops.into_iter().enumerate();
        all.filter(|(_, runs)| !runs.is_empty()).collect()
    }
}
