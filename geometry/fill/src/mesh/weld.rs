//! Vertices at one place made one.

use std::collections::HashMap;

use glam::DVec3;

use super::{Edges, TriangleMesh};

/// Makes one of all vertices with the same coordinates; how many there were too many.
pub(super) fn weld_equal(mesh: &mut TriangleMesh) -> usize {
    let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.vertices_mm.len());
    let mut new_of = Vec::with_capacity(mesh.vertices_mm.len());
    let mut kept: Vec<[f64; 3]> = Vec::new();
    for place in &mesh.vertices_mm {
        // Adding zero makes one of both zeros.
        let key = place.map(|c| (c + 0.0).to_bits());
        let next = kept.len() as u32;
        let own = *first.entry(key).or_insert(next);
        if own == next {
            kept.push(*place);
        }
        new_of.push(own);
    }
    let welded = mesh.vertices_mm.len() - kept.len();
    mesh.vertices_mm = kept;
    for corner in mesh.triangles.as_flattened_mut() {
        *corner = new_of[*corner as usize];
    }
    welded
}

/// Makes one of vertices on borders that are within a distance of each other, at the place of the one
/// that comes first; how many moved. Those of one triangle stay apart.
pub(super) fn weld_near(mesh: &mut TriangleMesh, within_mm: f64) -> usize {
    if within_mm <= 0.0 {
        return 0;
    }
    let edges = Edges::of(&mesh.triangles);
    let mut border: Vec<u32> = edges.border().flat_map(|(from, to)| [from, to]).collect();
    border.sort_unstable();
    border.dedup();
    let cell = |at: DVec3| (at / within_mm).floor().to_array().map(|c| c as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut new_of: HashMap<u32, u32> = HashMap::new();
    for &vertex in &border {
        let at = mesh.place(vertex);
        let own = cell(at);
        let around = (0..27).map(|k| {
            [
                own[0] + k / 9 - 1,
                own[1] + k / 3 % 3 - 1,
                own[2] + k % 3 - 1,
            ]
        });
        let found = around
            .filter_map(|cell| cells.get(&cell))
            .flatten()
            .copied()
            .find(|&other| mesh.place(other).distance(at) <= within_mm);
        match found {
            Some(other) => {
                new_of.insert(vertex, other);
            }
            None => cells.entry(own).or_default().push(vertex),
        }
    }
    if new_of.is_empty() {
        return 0;
    }
    for triangle in &mut mesh.triangles {
        let own = triangle.map(|v| new_of.get(&v).copied().unwrap_or(v));
        if own[0] != own[1] && own[1] != own[2] && own[2] != own[0] {
            *triangle = own;
        }
    }
    new_of.len()
}
