//! Triangle meshes from STL files, met through a bounding-volume hierarchy.

use std::collections::BTreeMap;
use std::io::{Read, Seek};

use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;
use thiserror::Error;

use crate::Vec3;
use crate::scene::FaceSurface;

/// Most triangles taken from a file: more would need gigabytes for the hierarchy.
pub const TRIANGLES_MAX: usize = 5_000_000;

/// Neighbouring triangles belong to one face while their normals differ by less than this.
const COPLANAR_RAD: f64 = 1e-3;

/// Why an STL file cannot serve as an object.
#[derive(Debug, Error)]
pub enum StlError {
    /// The file is not readable as STL, neither text nor binary.
    #[error("not an STL file, or a damaged one: {0}")]
    Read(#[from] std::io::Error),
    /// The file has no triangle with an area.
    #[error("no triangle with an area in it")]
    Empty,
    /// The file is beyond what the simulator takes.
    #[error("{found} triangles; at most {TRIANGLES_MAX} are taken: decimate the mesh first")]
    TooLarge {
        /// Triangles in the file.
        found: usize,
    },
    /// A vertex has a coordinate that is no number.
    #[error("vertex {index} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex, counted from 0 after joining equal ones.
        index: usize,
    },
    /// The hierarchy could not be built.
    #[error("the mesh cannot be searched: {0}")]
    Build(String),
}

/// How far behind a triangle's back a ray goes on, millimetres.
const BEHIND_MM: f64 = 1e-7;
/// Backs of triangles that a ray passes, at most.
const BACKS_MOST: usize = 64;

/// A face of a closed body, by triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFace {
    /// Corners, counter-clockwise from outside, millimetres.
    pub triangles_mm: Vec<[Vec3; 3]>,
    /// What the triangles stand for, if it is known: rays then meet that.
    pub surface: Option<FaceSurface>,
}

/// A mesh in the coordinates of its file.
#[derive(Debug, Clone)]
pub struct Mesh {
    triangles: TriMesh,
    groups: Vec<usize>,
    group_count: usize,
    /// Of each group; empty where none is known.
    surfaces: Vec<Option<FaceSurface>>,
    /// Triangles are to be trusted with orientation.
    is_oriented: bool,
}

impl Mesh {
    /// Reads a text or binary STL file.
    ///
    /// # Errors
    /// [`StlError`] when the file is not STL, is empty, too large or has broken numbers.
    pub fn read_stl(source: &mut (impl Read + Seek)) -> Result<Self, StlError> {
        let file = stl_io::read_stl(source)?;
        if file.faces.len() > TRIANGLES_MAX {
            return Err(StlError::TooLarge {
                found: file.faces.len(),
            });
        }
        let vertices: Vec<Vec3> = file
            .vertices
            .iter()
            .map(|v| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])))
            .collect();
        if let Some(index) = vertices.iter().position(|v| !v.is_finite()) {
            return Err(StlError::NotFinite { index });
        }
        Self::new(vertices, file.faces.iter().map(|face| face.vertices))
    }

    /// A mesh of triangles given as indices of vertices in millimetres; those without an area
    /// are left out.
    ///
    /// # Errors
    /// [`StlError::Empty`] when nothing is left, [`StlError::Build`] when the hierarchy fails.
    pub fn new(
        vertices_mm: Vec<Vec3>,
        faces: impl IntoIterator<Item = [usize; 3]>,
    ) -> Result<Self, StlError> {
        let mut indices = Vec::new();
        let mut normals = Vec::new();
        for face in faces {
            let corner = |k: usize| vertices_mm.get(face[k]).copied();
            let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
                continue;
            };
            let normal = (b - a).cross(c - a);
            if normal.length_squared() > 0.0 {
                // read_stl caps the count, so an index always fits.
                indices.push(face.map(|i| u32::try_from(i).unwrap_or(u32::MAX)));
                normals.push(normal.normalize());
            }
        }
        let groups = coplanar_groups(&indices, &normals);
        Self::grouped(vertices_mm, indices, groups)
    }

    /// A mesh that stands for one curved face, whatever the angles between its triangles.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn one_face(
        vertices_mm: Vec<Vec3>,
        faces: impl IntoIterator<Item = [usize; 3]>,
    ) -> Result<Self, StlError> {
        let mut mesh = Self::new(vertices_mm, faces)?;
        mesh.groups.fill(0);
        mesh.group_count = 1;
        Ok(mesh)
    }

    /// A closed body of faces that are known, each a group of its own whatever the angles
    /// between its triangles. Rays go through the backs of triangles: those of a hollow lie
    /// before the surface that they stand for.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn of_faces(faces: &[MeshFace]) -> Result<Self, StlError> {
        let found = faces.iter().map(|face| face.triangles_mm.len()).sum();
        if found > TRIANGLES_MAX {
            return Err(StlError::TooLarge { found });
        }
        let (mut vertices_mm, mut indices, mut groups) = (Vec::new(), Vec::new(), Vec::new());
        for (group, face) in faces.iter().enumerate() {
            for corners in &face.triangles_mm {
                let [a, b, c] = *corners;
                if let Some(corner) = corners.iter().position(|corner| !corner.is_finite()) {
                    return Err(StlError::NotFinite {
                        index: vertices_mm.len() + corner,
                    });
                }
                if (b - a).cross(c - a).length_squared() > 0.0 {
                    // The count is capped, so an index always fits.
                    let first = u32::try_from(vertices_mm.len()).unwrap_or(u32::MAX);
                    indices.push([first, first + 1, first + 2]);
                    vertices_mm.extend(corners);
                    groups.push(group);
                }
            }
        }
        let mut mesh = Self::grouped(vertices_mm, indices, groups)?;
        mesh.group_count = faces.len();
        mesh.surfaces = faces.iter().map(|face| face.surface).collect();
        mesh.is_oriented = true;
        Ok(mesh)
    }

    fn grouped(
        vertices_mm: Vec<Vec3>,
        indices: Vec<[u32; 3]>,
        groups: Vec<usize>,
    ) -> Result<Self, StlError> {
        if indices.is_empty() {
            return Err(StlError::Empty);
        }
        let group_count = groups.iter().max().map_or(0, |last| last + 1);
        let triangles = TriMesh::new(vertices_mm, indices)
            .map_err(|error| StlError::Build(error.to_string()))?;
        Ok(Self {
            triangles,
            groups,
            group_count,
            surfaces: Vec::new(),
            is_oriented: false,
        })
    }

    /// Number of groups of neighbouring coplanar triangles.
    #[must_use]
    pub fn group_count(&self) -> usize {
        self.group_count
    }

    /// Where a ray meets the mesh: distance, unit normal towards the ray's origin (files are
    /// not to be trusted with orientation), and the face group.
    pub(crate) fn enter(&self, origin: Vec3, direction: Vec3) -> Option<(f64, Vec3, usize)> {
        let mut begin_mm = 0.0;
        for _ in 0..BACKS_MOST {
            let met = self.triangles.cast_local_ray_and_get_normal(
                &Ray::new(origin + direction * begin_mm, direction),
                f64::INFINITY,
                false,
            )?;
            let distance_mm = begin_mm + met.time_of_impact;
            if self.is_oriented && self.is_back(met.subshape, direction) {
                begin_mm = distance_mm + BEHIND_MM;
                continue;
            }
            let group = *self.groups.get(met.subshape as usize)?;
            let surface = self.surfaces.get(group).copied().flatten();
            let (distance_mm, normal) = surface
                .and_then(|surface| surface.met_near(origin, direction, distance_mm))
                .unwrap_or((distance_mm, met.normal.normalize_or_zero()));
            let towards = if normal.dot(direction) <= 0.0 {
                normal
            } else {
                -normal
            };
            return Some((distance_mm, towards, group));
        }
        None
    }

    /// Whether a ray in this direction meets a triangle from within the body.
    fn is_back(&self, triangle: u32, direction: Vec3) -> bool {
        let corners = self.triangles.triangle(triangle);
        let normal = (corners.b - corners.a).cross(corners.c - corners.a);
        normal.dot(direction) > 0.0
    }

    /// Lower and upper corner of the box around the mesh, millimetres.
    #[must_use]
    pub fn extent_mm(&self) -> (Vec3, Vec3) {
        let bounds = self.triangles.local_aabb();
        (bounds.mins, bounds.maxs)
    }
}

/// For each triangle the number of its group, groups numbered as they are met.
fn coplanar_groups(indices: &[[u32; 3]], normals: &[Vec3]) -> Vec<usize> {
    let mut parents: Vec<usize> = (0..indices.len()).collect();
    let mut across: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let least_cos = libm::cos(COPLANAR_RAD);
    for (triangle, corners) in indices.iter().enumerate() {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let edge = (
                corners[from].min(corners[to]),
                corners[from].max(corners[to]),
            );
            if let Some(other) = across.insert(edge, triangle) {
                let (Some(a), Some(b)) = (normals.get(triangle), normals.get(other)) else {
                    continue;
                };
                if a.dot(*b) >= least_cos {
                    let (a, b) = (root(&mut parents, triangle), root(&mut parents, other));
                    parents[a.max(b)] = a.min(b);
                }
            }
        }
    }
    let mut numbers = BTreeMap::new();
    (0..indices.len())
        .map(|triangle| {
            let next = numbers.len();
            *numbers.entry(root(&mut parents, triangle)).or_insert(next)
        })
        .collect()
}

fn root(parents: &mut [usize], mut node: usize) -> usize {
    while parents[node] != node {
        parents[node] = parents[parents[node]];
        node = parents[node];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of side 2 around the origin, two triangles a side.
    fn cube() -> Mesh {
        let vertices = (0..8)
            .map(|i| {
                let side = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
                Vec3::new(side(1), side(2), side(4))
            })
            .collect();
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let faces = quads
            .into_iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        Mesh::new(vertices, faces).expect("a cube has triangles")
    }

    #[test]
    fn a_side_of_two_triangles_is_one_face() {
        let cube = cube();
        assert_eq!(cube.group_count(), 6);
        let hit = |x, y| cube.enter(Vec3::new(x, y, 9.0), Vec3::NEG_Z);
        let (distance, normal, group) = hit(0.5, -0.25).expect("over the top side");
        assert_eq!(distance, 8.0);
        assert!(normal.distance(Vec3::Z) < 1e-12);
        assert_eq!(hit(-0.5, 0.25).map(|(_, _, g)| g), Some(group));
        assert!(hit(1.5, 0.0).is_none());
    }

    #[test]
    fn a_curved_face_is_one_whatever_its_triangles() {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.4)];
        let faces = [[0, 1, 2], [1, 3, 2]];
        let bent = Mesh::new(vertices.clone(), faces).expect("two triangles");
        assert_eq!(bent.group_count(), 2);
        let face = Mesh::one_face(vertices, faces).expect("two triangles");
        assert_eq!(face.group_count(), 1);
        let hit = face.enter(Vec3::new(0.8, 0.8, 9.0), Vec3::NEG_Z);
        assert_eq!(hit.map(|(_, _, group)| group), Some(0));
        assert!(Mesh::one_face(Vec::new(), []).is_err());
    }

    #[test]
    fn what_is_no_stl_is_refused() {
        let mut text = std::io::Cursor::new(b"x y z\n1 2 3\n".to_vec());
        assert!(Mesh::read_stl(&mut text).is_err());
        let nothing = b"solid none\nendsolid none\n".to_vec();
        let read = Mesh::read_stl(&mut std::io::Cursor::new(nothing));
        assert!(matches!(read, Err(StlError::Empty)), "{read:?}");
    }

    /// A ball of coarse triangles that stand for a sphere, turned inside out or not.
    fn ball(is_hollow: bool) -> Mesh {
        let at = |i: usize, j: usize| {
            let (up, around) = (i as f64 / 12.0, j as f64 / 24.0);
            let (sin, cos) = libm::sincos(core::f64::consts::PI * up);
            let (y, x) = libm::sincos(core::f64::consts::TAU * around);
            Vec3::new(sin * x, sin * y, cos) * 2.0
        };
        let cells = (0..12).flat_map(|i| (0..24).map(move |j| (i, j)));
        let triangles = cells.flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        });
        let turned = |[a, b, c]: [Vec3; 3]| if is_hollow { [a, c, b] } else { [a, b, c] };
        let face = MeshFace {
            triangles_mm: triangles.map(turned).collect(),
            surface: Some(FaceSurface::Surface(crate::scene::Surface::Sphere {
                centre_mm: Vec3::ZERO,
                radius_mm: 2.0,
            })),
        };
        Mesh::of_faces(&[face]).expect("triangles")
    }

    #[test]
    fn a_known_face_is_met_where_it_is_and_not_where_its_triangles_are() {
        let start = Vec3::new(0.31, -0.42, 9.0);
        let z = libm::sqrt(4.0 - 0.31 * 0.31 - 0.42 * 0.42);
        let (distance, normal, face) = ball(false).enter(start, Vec3::NEG_Z).expect("the top");
        assert!((distance - (9.0 - z)).abs() < 1e-9);
        assert!(normal.distance(Vec3::new(0.31, -0.42, z) / 2.0) < 1e-9);
        assert_eq!(face, 0);
        // From the outside a hollow is met at its far side, through the backs of the near one.
        let (distance, normal, _) = ball(true).enter(start, Vec3::NEG_Z).expect("the floor");
        assert!((distance - (9.0 + z)).abs() < 1e-9);
        assert!(normal.z > 0.0);
    }

    #[test]
    fn a_point_of_a_hollow_is_seen_though_it_lies_behind_its_triangles() {
        let scene = crate::scene::Scene::new(
            vec![crate::scene::Body::Mesh(Box::new(ball(true)))],
            crate::scene::Material::PLASTER,
        );
        // From within: from outside the near side of the hollow hides it.
        let within = Vec3::new(0.31, -0.42, 0.5);
        let hit = scene.cast(within, Vec3::NEG_Z).expect("the floor");
        assert!((hit.point_mm.length() - 2.0).abs() < 1e-9);
        assert!(scene.sees(hit.point_mm, hit.normal, within));
        assert!(!scene.sees(hit.point_mm, hit.normal, Vec3::new(0.31, -0.42, 9.0)));
    }
}
