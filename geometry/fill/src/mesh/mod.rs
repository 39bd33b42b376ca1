//! Triangles, their neighbours, and what is wrong with them.

mod edges;
mod mend;
mod split;
mod stars;
mod weld;

use crate::error::FillError;

pub(crate) use edges::{Edges, NONE, ends};
pub use mend::Mended;
pub(crate) use mend::mend;
pub(crate) use split::split_fans;
pub(crate) use stars::Stars;

/// Triangles over shared vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    /// Where triangles have their corners.
    pub vertices_mm: Vec<[f64; 3]>,
    /// Indices of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    pub(crate) fn validate(&self) -> Result<(), FillError> {
        if self.triangles.is_empty() {
            return Err(FillError::Empty);
        }
        let is_finite = |p: &[f64; 3]| p.iter().all(|c| c.is_finite());
        if let Some(vertex) = self.vertices_mm.iter().position(|p| !is_finite(p)) {
            return Err(FillError::NotFinite { vertex: vertex + 1 });
        }
        let vertices = self.vertices_mm.len();
        let is_there = |v: u32| (v as usize) < vertices;
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| !is_there(**v)) {
                return Err(FillError::NoVertex {
                    triangle: triangle + 1,
                    vertex: vertex as usize + 1,
                    vertices,
                });
            }
        }
        Ok(())
    }

    /// Leaves out vertices that no triangle has; how many.
    pub(crate) fn compact(&mut self) -> usize {
        let mut is_used = vec![false; self.vertices_mm.len()];
        for &vertex in self.triangles.as_flattened() {
            is_used[vertex as usize] = true;
        }
        let before = self.vertices_mm.len();
        let mut new_of = vec![0_u32; before];
        let mut count = 0;
        for vertex in 0..before {
            if is_used[vertex] {
                new_of[vertex] = count as u32;
                self.vertices_mm[count] = self.vertices_mm[vertex];
                count += 1;
            }
        }
        self.vertices_mm.truncate(count);
        for corner in self.triangles.as_flattened_mut() {
            *corner = new_of[*corner as usize];
        }
        before - count
    }

    pub(crate) fn place(&self, vertex: u32) -> glam::DVec3 {
        glam::DVec3::from_array(self.vertices_mm[vertex as usize])
    }

    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [glam::DVec3; 3] {
        triangle.map(|v| self.place(v))
    }

    /// Twice the area, along the normal.
    pub(crate) fn doubled_area(&self, triangle: [u32; 3]) -> glam::DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }
}
