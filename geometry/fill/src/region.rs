//! What of a mesh matters to a hole.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};

use glam::DVec3;

use crate::holes::Hole;
use crate::implicit::Sample;
use crate::mesh::{Stars, TriangleMesh};

/// Width of the region around a hole, of the hole's size.
const WIDTH: f64 = 0.5;
/// Rings that belong to it however small the hole is.
const RINGS: f64 = 4.0;
/// Vertices that it has at least, if the mesh has them, and at most.
const FEWEST: usize = 60;
const MOST: usize = 200_000;

/// A distance that can be ordered.
#[derive(PartialEq)]
struct Far(f64);

impl Eq for Far {}

impl PartialOrd for Far {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Far {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Points around a hole, nearest to its loops first, by ways along edges: what only comes near through
/// space, such as the other side of a wall, is not of it.
pub(crate) fn around(
    mesh: &TriangleMesh,
    stars: &Stars,
    loops: &[&Hole],
    size_mm: f64,
) -> Vec<Sample> {
    let edges: usize = loops.iter().map(|own| own.vertices.len()).sum();
    let length_mm: f64 = loops.iter().map(|own| own.length_mm).sum();
    let edge_mm = length_mm / edges.max(1) as f64;
    let width_mm = (WIDTH * size_mm).max(RINGS * edge_mm);
    let mut far: HashMap<u32, f64> = HashMap::new();
    let mut queue = BinaryHeap::new();
    for &vertex in loops.iter().flat_map(|own| &own.vertices) {
        far.insert(vertex, 0.0);
        queue.push(Reverse((Far(0.0), vertex)));
    }
    let mut is_done = HashSet::new();
    let mut samples = Vec::new();
    while let Some(Reverse((Far(own), vertex))) = queue.pop() {
        if !is_done.insert(vertex) {
            continue;
        }
        if own > width_mm && samples.len() >= FEWEST || samples.len() >= MOST {
            break;
        }
        let at = mesh.place(vertex);
        samples.push(Sample {
            place_mm: at,
            normal: stars.normal(mesh, vertex),
            reach_mm: own,
        });
        for &t in stars.around(vertex) {
            for other in mesh.triangles[t as usize] {
                let next = own + at.distance(mesh.place(other));
                let known = far.entry(other).or_insert(f64::INFINITY);
                if next < *known {
                    *known = next;
                    queue.push(Reverse((Far(next), other)));
                }
            }
        }
    }
    samples
}

/// Mean length of the edges that meet a vertex.
pub(crate) fn edge_length(mesh: &TriangleMesh, stars: &Stars, vertex: u32) -> f64 {
    let at = mesh.place(vertex);
    let (mut sum, mut count) = (0.0, 0.0);
    for &t in stars.around(vertex) {
        for other in mesh.triangles[t as usize] {
            if other != vertex {
                sum += at.distance(mesh.place(other));
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Mean unit normal of samples; zero where they have none.
pub(crate) fn mean_normal(samples: &[Sample]) -> DVec3 {
    let sum: DVec3 = samples.iter().map(|own| own.normal).sum();
    sum.normalize_or_zero()
}
