//! The triangles around each vertex.

use glam::DVec3;

use super::TriangleMesh;

/// Triangles by vertex.
#[derive(Debug, Clone)]
pub(crate) struct Stars {
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl Stars {
    pub(crate) fn of(mesh: &TriangleMesh) -> Self {
        let count = mesh.vertices_mm.len();
        let mut first = vec![0_u32; count + 1];
        for &v in mesh.triangles.as_flattened() {
            first[v as usize + 1] += 1;
        }
        for k in 0..count {
            first[k + 1] += first[k];
        }
        let mut next = first.clone();
        let mut triangles = vec![0; 3 * mesh.triangles.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                triangles[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Self { first, triangles }
    }

    /// Triangles that have a vertex.
    pub(crate) fn around(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.triangles[self.first[v] as usize..self.first[v + 1] as usize]
    }

    /// The mean normal of the triangles around a vertex, each by its angle there; zero where there is
    /// none.
    pub(crate) fn normal(&self, mesh: &TriangleMesh, vertex: u32) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for &t in self.around(vertex) {
            let corners = mesh.triangles[t as usize];
            let k = corners.iter().position(|&v| v == vertex).unwrap_or(0);
            let [a, b, c] = [0, 1, 2].map(|j| mesh.place(corners[(k + j) % 3]));
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let (u, v) = ((b - a).normalize_or_zero(), (c - a).normalize_or_zero());
            sum += normal * libm::acos(u.dot(v).clamp(-1.0, 1.0));
        }
        sum.normalize_or_zero()
    }

    /// The triangle that runs along an edge from one vertex to the other.
    pub(crate) fn along(&self, mesh: &TriangleMesh, from: u32, to: u32) -> Option<u32> {
        let runs = |t: &&u32| {
            let own = mesh.triangles[**t as usize];
            (0..3).any(|k| own[k] == from && own[(k + 1) % 3] == to)
        };
        self.around(from).iter().find(runs).copied()
    }

    /// Twice the area of that triangle, along its normal.
    pub(crate) fn beside(&self, mesh: &TriangleMesh, from: u32, to: u32) -> DVec3 {
        let own = self.along(mesh, from, to);
        own.map_or(DVec3::ZERO, |t| {
            mesh.doubled_area(mesh.triangles[t as usize])
        })
    }

    /// Whether two vertices have an edge between them.
    pub(crate) fn are_joined(&self, mesh: &TriangleMesh, a: u32, b: u32) -> bool {
        self.around(a)
            .iter()
            .any(|&t| mesh.triangles[t as usize].contains(&b))
    }
}
