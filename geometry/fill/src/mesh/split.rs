//! Vertices in which fans of triangles meet that share no edge.

use super::{Edges, NONE, TriangleMesh, edges};

/// Gives every fan of triangles around a vertex a vertex of its own at the same place; how many there
/// are more. Two triangles are of one fan where a chain of them leads from one to the other across
/// edges that exactly two triangles have.
pub(crate) fn split_fans(mesh: &mut TriangleMesh) -> usize {
    let opposite = Edges::of(&mesh.triangles).opposite();
    let count = mesh.vertices_mm.len();
    let mut is_used = vec![false; count];
    // By side: the corner at which the side begins.
    let mut is_done = vec![false; opposite.len()];
    let mut added = 0;
    for start in 0..opposite.len() as u32 {
        if is_done[start as usize] {
            continue;
        }
        let fan = fan(&mesh.triangles, &opposite, start);
        let vertex = mesh.triangles[start as usize / 3][start as usize % 3];
        for &corner in &fan {
            is_done[corner as usize] = true;
        }
        if !is_used[vertex as usize] {
            is_used[vertex as usize] = true;
            continue;
        }
        let new = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.push(mesh.vertices_mm[vertex as usize]);
        is_used.push(true);
        added += 1;
        for corner in fan {
            mesh.triangles[corner as usize / 3][corner as usize % 3] = new;
        }
    }
    added
}

/// The corners of one fan, as sides that begin at them.
fn fan(triangles: &[[u32; 3]], opposite: &[u32], start: u32) -> Vec<u32> {
    let before = |side: u32| side / 3 * 3 + (side + 2) % 3;
    let after = |side: u32| side / 3 * 3 + (side + 1) % 3;
    let vertex = edges::ends(triangles, start).0;
    let mut fan = vec![start];
    // One way around, and if that ends at a border, the other.
    let mut side = start;
    loop {
        let next = opposite[before(side) as usize];
        if next == NONE || edges::ends(triangles, next).0 != vertex {
            break;
        }
        if next == start {
            return fan;
        }
        fan.push(next);
        side = next;
    }
    side = start;
    loop {
        let across = opposite[side as usize];
        if across == NONE || edges::ends(triangles, across).1 != vertex {
            return fan;
        }
        side = after(across);
        if side == start {
            return fan;
        }
        fan.push(side);
    }
}
