//! Triangles by face.

use std::collections::BTreeMap;

use crate::vector::{Point3, cross, minus, norm};

/// Triangles of a model, millimetres, part frame. All of them turn counter-clockwise as the
/// camera sees them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Where triangles have their corners; faces that share a seam name the same ones.
    pub vertices_mm: Vec<[f64; 3]>,
    /// In the order of the model's faces.
    pub faces: Vec<MeshFace>,
    /// How far the triangles lie off.
    pub accuracy: Accuracy,
}

/// The triangles of a face.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFace {
    /// The face's name.
    pub name: String,
    /// The region that it came from.
    pub region: u16,
    /// What its surface is, in words.
    pub form: &'static str,
    /// Its vertices.
    pub corners: Vec<Corner>,
    /// Indices into [`MeshFace::corners`], three to a triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex as a face has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Index into [`Mesh::vertices_mm`].
    pub vertex: u32,
    /// Unit normal of the face's surface there, on the side of +z.
    pub normal: [f64; 3],
}

/// How far triangles lie off what they stand for, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Accuracy {
    /// Farthest that a triangle between points of a surface lies off it, at the seven places of
    /// each that are looked at.
    pub surface_mm: f64,
    /// Farthest that a vertex of a seam lies off one of its two surfaces, along z: half of what
    /// these are apart.
    pub seam_mm: f64,
}

impl MeshFace {
    /// The triangles with indices into [`Mesh::vertices_mm`].
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        self.triangles
            .iter()
            .map(|corners| corners.map(|k| self.corners[k as usize].vertex))
    }
}

impl Mesh {
    /// How many triangles there are.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.faces.iter().map(|face| face.triangles.len()).sum()
    }

    /// The corners of a triangle, millimetres.
    #[must_use]
    pub fn corners_mm(&self, triangle: [u32; 3]) -> [[f64; 3]; 3] {
        triangle.map(|vertex| self.vertices_mm[vertex as usize])
    }

    /// Area of all triangles, mm2.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let faces = self.faces.iter();
        let areas = faces.flat_map(|face| face.triangles().map(|t| area(self.corners_mm(t))));
        areas.sum()
    }

    /// Sides that belong to one triangle only.
    #[must_use]
    pub fn free_edges(&self) -> usize {
        self.edge_uses().values().filter(|uses| **uses == 1).count()
    }

    /// How many triangles have each side, by its two vertices, the lesser first.
    #[must_use]
    pub fn edge_uses(&self) -> BTreeMap<[u32; 2], usize> {
        let mut uses = BTreeMap::new();
        for triangle in self.faces.iter().flat_map(MeshFace::triangles) {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                *uses.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        uses
    }
}

fn area([a, b, c]: [Point3; 3]) -> f64 {
    norm(cross(minus(b, a), minus(c, a))) / 2.0
}
