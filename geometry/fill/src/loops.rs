//! Borders walked around.

use std::collections::HashMap;

use crate::mesh::{Edges, TriangleMesh};

/// Simple loops of border edges: vertices in the order in which triangles that close the loop run along
/// it. Where borders touch in a vertex they are taken apart there.
///
/// Each loop begins at its lowest vertex, and they are ordered by it, so that the order depends on the
/// mesh alone.
pub(crate) fn loops(mesh: &TriangleMesh, edges: &Edges) -> Vec<Vec<u32>> {
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut starts = Vec::new();
    for (from, to) in edges.border() {
        // What closes it runs the other way.
        next.entry(to).or_default().push(from);
        starts.push(to);
    }
    starts.sort_unstable();
    starts.dedup();
    // Taken from the end: lowest first.
    next.values_mut()
        .for_each(|own| own.sort_unstable_by(|a, b| b.cmp(a)));
    let mut loops = Vec::new();
    let mut place_in_walk: HashMap<u32, usize> = HashMap::new();
    for start in starts {
        let mut walk: Vec<u32> = Vec::new();
        let mut at = start;
        loop {
            if let Some(&since) = place_in_walk.get(&at) {
                // Back at a vertex: what lies between is a loop of its own.
                let own = walk.split_off(since);
                own.iter().for_each(|v| {
                    place_in_walk.remove(v);
                });
                loops.push(own);
            }
            let Some(to) = next.get_mut(&at).and_then(Vec::pop) else {
                break;
            };
            place_in_walk.insert(at, walk.len());
            walk.push(at);
            at = to;
        }
        // Every vertex has as many border edges that lead to it as lead away, so that walks end empty;
        // what does not is left alone.
        place_in_walk.clear();
    }
    for own in &mut loops {
        let lowest = (0..own.len()).min_by_key(|&k| own[k]).unwrap_or(0);
        own.rotate_left(lowest);
    }
    loops.retain(|own| own.len() >= 3);
    loops.sort();
    debug_assert!(mesh.vertices_mm.len() < u32::MAX as usize);
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a square grid, but those of some squares.
    fn grid(size: u32, holes: &[(u32, u32)]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for y in 0..=size {
            for x in 0..=size {
                mesh.vertices_mm.push([f64::from(x), f64::from(y), 0.0]);
            }
        }
        for y in 0..size {
            for x in 0..size {
                if holes.contains(&(x, y)) {
                    continue;
                }
                let at = |dx: u32, dy: u32| (y + dy) * (size + 1) + x + dx;
                mesh.triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                mesh.triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
        mesh
    }

    fn lengths(mesh: &TriangleMesh) -> Vec<usize> {
        let own = loops(mesh, &Edges::of(&mesh.triangles));
        own.iter().map(Vec::len).collect()
    }

    #[test]
    fn a_border_and_a_hole() {
        let mesh = grid(5, &[(2, 2)]);
        assert_eq!(lengths(&mesh), [20, 4]);
        // What closes the hole runs counter-clockwise as the mesh does.
        let own = loops(&mesh, &Edges::of(&mesh.triangles)).remove(1);
        let at = |k: usize| mesh.place(own[k]);
        assert!((at(1) - at(0)).cross(at(2) - at(1)).z > 0.0);
    }

    #[test]
    fn holes_that_touch_are_taken_apart() {
        assert_eq!(lengths(&grid(6, &[(2, 2), (3, 3)])), [24, 4, 4]);
        assert_eq!(lengths(&grid(6, &[(2, 2), (3, 3), (2, 4)])), [24, 4, 4, 4]);
        // A ring of four that touch around a square.
        let ring = [(2, 1), (1, 2), (3, 2), (2, 3)];
        let own = lengths(&grid(6, &ring));
        assert_eq!(own.iter().sum::<usize>(), 24 + 16);
        assert!(own.len() >= 3, "{own:?}");
    }
}
