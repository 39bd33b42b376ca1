//! The border of a hole as one polygon.

use std::collections::HashMap;

use glam::DVec3;

use crate::holes::Hole;
use crate::mesh::{Stars, TriangleMesh};
use crate::region::edge_length;

/// Vertices of a coarse polygon, about; where it would leave the border, more.
const COARSE: usize = 56;
/// How far skipped vertices may lie off the chord that skips them, of its length.
const OFF_CHORD: f64 = 0.3;

/// A closed chain of border vertices, islands cut open along bridges that it runs both ways.
#[derive(Debug, Clone)]
pub(crate) struct Polygon {
    /// The mesh's vertex by the number that it has here.
    pub(crate) vertices: Vec<u32>,
    /// Numbers of vertices in order; those of bridges stand there twice.
    pub(crate) chain: Vec<u32>,
    /// By place in the chain: the normal of the triangle outside, across the edge to the next.
    pub(crate) outside: Vec<Option<DVec3>>,
}

impl Polygon {
    /// Of a hole's loop and those of islands in it.
    pub(crate) fn of(mesh: &TriangleMesh, stars: &Stars, hole: &Hole, islands: &[&Hole]) -> Self {
        let mut ids: Vec<u32> = hole.vertices.clone();
        // Nearest first, so that bridges do not run through islands; the order depends on the mesh alone.
        let mut left: Vec<&[u32]> = islands.iter().map(|own| &own.vertices[..]).collect();
        while !left.is_empty() {
            let mut best = (f64::INFINITY, 0, 0, 0);
            for (which, own) in left.iter().enumerate() {
                for (j, &inner) in own.iter().enumerate() {
                    for (i, &outer) in ids.iter().enumerate() {
                        let apart = mesh.place(inner).distance_squared(mesh.place(outer));
                        if apart < best.0 {
                            best = (apart, which, i, j);
                        }
                    }
                }
            }
            let (_, which, i, j) = best;
            let own = left.swap_remove(which);
            let mut detour: Vec<u32> = own[j..].iter().chain(&own[..=j]).copied().collect();
            detour.push(ids[i]);
            let tail = ids.split_off(i + 1);
            ids.extend(detour);
            ids.extend(tail);
        }
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut vertices = Vec::new();
        let chain: Vec<u32> = ids
            .iter()
            .map(|&id| {
                *numbers.entry(id).or_insert_with(|| {
                    vertices.push(id);
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        let outside = (0..ids.len())
            .map(|k| {
                let (own, next) = (ids[k], ids[(k + 1) % ids.len()]);
                let normal = stars.beside(mesh, next, own).normalize_or_zero();
                stars.along(mesh, next, own).map(|_| normal)
            })
            .collect();
        Self {
            vertices,
            chain,
            outside,
        }
    }

    pub(crate) fn places(&self, mesh: &TriangleMesh) -> Vec<DVec3> {
        self.vertices.iter().map(|&v| mesh.place(v)).collect()
    }

    /// Places in the chain of a coarser polygon: evenly by length, and wherever what is skipped would
    /// lie far off. All of them where there are few.
    pub(crate) fn coarse(&self, places: &[DVec3]) -> Vec<usize> {
        let count = self.chain.len();
        if count <= 3 * COARSE / 2 {
            return (0..count).collect();
        }
        let at = |k: usize| places[self.chain[k % count] as usize];
        let lengths: Vec<f64> = (0..count).map(|k| at(k).distance(at(k + 1))).collect();
        let total: f64 = lengths.iter().sum();
        let mut kept = vec![false; count];
        let (mut gone, mut next) = (0.0, 0.0);
        for k in 0..count {
            // Ends of bridges stay: they stand in the chain twice.
            let is_bridge =
                self.outside[k].is_none() || self.outside[(k + count - 1) % count].is_none();
            if gone >= next || is_bridge {
                kept[k] = true;
                next = gone + total / COARSE as f64;
            }
            gone += lengths[k];
        }
        let mut chosen: Vec<usize> = (0..count).filter(|&k| kept[k]).collect();
        // The farthest of what is skipped, until nothing is far.
        let mut k = 0;
        while k < chosen.len() {
            let from = chosen[k];
            let to = chosen.get(k + 1).copied().unwrap_or(chosen[0] + count);
            let (a, b) = (at(from), at(to));
            let chord = b - a;
            let off = |own: usize| {
                let arm = at(own) - a;
                let along = (arm.dot(chord) / chord.length_squared().max(f64::MIN_POSITIVE))
                    .clamp(0.0, 1.0);
                (arm - along * chord).length()
            };
            let far = (from + 1..to).max_by(|&x, &y| off(x).total_cmp(&off(y)).then(y.cmp(&x)));
            match far {
                Some(own) if off(own) > OFF_CHORD * chord.length() && own < count => {
                    chosen.insert(k + 1, own);
                }
                Some(own) if off(own) > OFF_CHORD * chord.length() => {
                    chosen.insert(0, own - count);
                    k += 2;
                }
                _ => k += 1,
            }
        }
        chosen
    }
}

/// Wanted length of edges at every vertex of a polygon.
pub(crate) fn border_sizes(
    mesh: &TriangleMesh,
    stars: &Stars,
    polygon: &Polygon,
    max_edge_mm: Option<f64>,
) -> Vec<f64> {
    // New edges are up to a third longer than wanted.
    let most = max_edge_mm.map_or(f64::INFINITY, |own| 0.75 * own);
    let size = |&v: &u32| edge_length(mesh, stars, v).min(most);
    polygon.vertices.iter().map(size).collect()
}
