//! The nominal: a triangle mesh that can be asked for its nearest visible facet.

use glam::DVec3;
use parry3d_f64::query::{PointQuery, Ray, RayCast};
use parry3d_f64::shape::TriMesh;

/// Most facets that are taken: more would need more than a gigabyte.
pub const FACETS_MAX: usize = 2_000_000;

/// Facets seen more slantingly than this, as the sine of the angle between line of sight and
/// facet, count as not seen: about 6 degrees.
const GRAZING: f64 = 0.1;

/// Facets are without an area when their height is below this share of the nominal's size: single
/// precision, in which STL files keep coordinates, tells no more.
const FLAT: f64 = 1e-8;

/// Why a mesh cannot serve as nominal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NominalError {
    /// There is no facet.
    #[error("holds no facet")]
    Empty,
    /// More facets than are taken.
    #[error("has {found} facets; at most {FACETS_MAX} are taken: decimate the mesh first")]
    TooLarge {
        /// Facets there are.
        found: usize,
    },
    /// A coordinate is no number, or beyond all bounds.
    #[error("facet {facet} has a vertex with a coordinate that is not a finite length")]
    NotFinite {
        /// The facet, from 1.
        facet: usize,
    },
    /// A facet names a vertex that there is not.
    #[error("facet {facet} names vertex {vertex}, of {vertices}")]
    NoVertex {
        /// The facet, from 1.
        facet: usize,
        /// The vertex, from 0.
        vertex: usize,
        /// Vertices there are.
        vertices: usize,
    },
    /// No facet has an area.
    #[error("none of its {facets} facets has an area")]
    NoArea {
        /// Facets there are.
        facets: usize,
    },
    /// Neighbours disagree on which side is outside, so that deviations would have no sign.
    #[error(
        "facet {facet} and its neighbour along the edge at ({:.3}, {:.3}, {:.3}) mm disagree on \
         which side is outside, and {others} more edges have the same trouble: repair the mesh",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    Orientation {
        /// One of the facets, from 1.
        facet: usize,
        /// Middle of the edge.
        at_mm: [f64; 3],
        /// Other such edges.
        others: usize,
    },
    /// The search tree could not be built.
    #[error("cannot be searched: {0}")]
    Search(String),
}

/// A triangle mesh that a scan is held against.
#[derive(Debug, Clone)]
pub struct Nominal {
    mesh: TriMesh,
    /// Unit normals of the facets, outwards.
    normals: Vec<DVec3>,
    remarks: Vec<String>,
    centre_mm: DVec3,
    /// Half the diagonal of the box around it.
    radius_mm: f64,
}

/// The nearest point of the nominal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(crate) point_mm: DVec3,
    pub(crate) normal: DVec3,
}

impl Nominal {
    /// A nominal of facets given as indices of vertices, counter-clockwise seen from outside.
    ///
    /// Facets without an area are left out, and a closed mesh that is inside out is turned; both
    /// are told by [`Nominal::remarks`], and so is a mesh that is not closed.
    ///
    /// # Errors
    /// [`NominalError`] when there is nothing to compare with, or outside is not told from inside.
    pub fn new(vertices_mm: &[[f64; 3]], facets: &[[usize; 3]]) -> Result<Self, NominalError> {
        if facets.is_empty() {
            return Err(NominalError::Empty);
        }
        if facets.len() > FACETS_MAX || vertices_mm.len() > 3 * FACETS_MAX {
            return Err(NominalError::TooLarge {
                found: facets.len(),
            });
        }
        let vertices: Vec<DVec3> = vertices_mm.iter().map(|&v| DVec3::from_array(v)).collect();
        let (low, high) = bounds(&vertices, facets)?;
        let size_mm = (high - low).length();
        let mut kept: Vec<[u32; 3]> = Vec::with_capacity(facets.len());
        // Numbers of the kept facets in the caller's count.
        let mut numbers = Vec::with_capacity(facets.len());
        let mut normals = Vec::with_capacity(facets.len());
        let mut first_flat = None;
        for (number, facet) in facets.iter().enumerate() {
            let [a, b, c] = facet.map(|index| vertices.get(index).copied().unwrap_or(DVec3::ZERO));
            let normal = (b - a).cross(c - a);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            if normal.length() <= FLAT * size_mm * longest {
                first_flat = first_flat.or(Some(number + 1));
                continue;
            }
            kept.push(facet.map(|index| u32::try_from(index).unwrap_or(u32::MAX)));
            numbers.push(number + 1);
            normals.push(normal.normalize_or_zero());
        }
        if kept.is_empty() {
            return Err(NominalError::NoArea {
                facets: facets.len(),
            });
        }
        let mut remarks = Vec::new();
        if let Some(first) = first_flat {
            let left_out = facets.len() - kept.len();
            remarks.push(format!(
                "{left_out} of {} facets have no area and were left out, the first is number {first}",
                facets.len()
            ));
        }
        let open = orientation(&vertices, &kept, &numbers)?;
        match open {
            // A facet without an area that was left out opens the mesh without opening the surface.
            Some((edges, at_mm)) if first_flat.is_none() => remarks.push(format!(
                "the mesh is open: {edges} edges have a facet on one side alone, the first at \
                 ({:.3}, {:.3}, {:.3}) mm",
                at_mm.x, at_mm.y, at_mm.z
            )),
            None if volume(&vertices, &kept) < 0.0 => {
                for (facet, normal) in kept.iter_mut().zip(&mut normals) {
                    facet.swap(1, 2);
                    *normal = -*normal;
                }
                remarks.push("the mesh is inside out and was turned".to_owned());
            }
            _ => {}
        }
        let mesh = TriMesh::new(vertices, kept)
            .map_err(|error| NominalError::Search(error.to_string()))?;
        Ok(Self {
            mesh,
            normals,
            remarks,
            centre_mm: (low + high) / 2.0,
            radius_mm: size_mm / 2.0,
        })
    }

    /// What is odd about the mesh, in words.
    #[must_use]
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// Number of facets that have an area.
    #[must_use]
    pub fn facets(&self) -> usize {
        self.normals.len()
    }

    /// Lower and upper corner of the box around it, millimetres.
    #[must_use]
    pub fn extent_mm(&self) -> ([f64; 3], [f64; 3]) {
        let bounds = self.mesh.local_aabb();
        (bounds.mins.to_array(), bounds.maxs.to_array())
    }

    pub(crate) fn centre_mm(&self) -> DVec3 {
        self.centre_mm
    }

    pub(crate) fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// The nearest point on facets that face the viewer, within a distance. `view` points to the
    /// viewer and is of unit length. What is hidden by others is not looked at.
    pub(crate) fn nearest(&self, point_mm: DVec3, view: DVec3, within_mm: f64) -> Option<Foot> {
        let facing = |facet: u32| {
            let normal = self.normals.get(facet as usize)?;
            (normal.dot(view) > GRAZING).then_some(*normal)
        };
        let (_, (_, foot)) = self.mesh.bvh().find_best(
            within_mm,
            |node, _| node.aabb().distance_to_local_point(point_mm, true),
            |facet, _| {
                let normal = facing(facet)?;
                let triangle = self.mesh.triangle(facet);
                let at = triangle.project_local_point(point_mm, false).point;
                let foot = Foot {
                    point_mm: at,
                    normal,
                };
                Some(((at - point_mm).length(), foot))
            },
        )?;
        Some(foot)
    }

    /// Where a ray first meets the nominal, and the normal there; `None` where it meets nothing
    /// or the back of a facet.
    pub(crate) fn first_met(&self, origin_mm: DVec3, direction: DVec3) -> Option<Foot> {
        let ray = Ray::new(origin_mm, direction);
        let met = self
            .mesh
            .cast_local_ray_and_get_normal(&ray, f64::INFINITY, false)?;
        let normal = *self.normals.get(met.subshape as usize)?;
        (normal.dot(direction) < -GRAZING).then_some(Foot {
            point_mm: origin_mm + direction * met.time_of_impact,
            normal,
        })
    }

    /// Centroid of what faces the viewer, by its area as seen; `None` where nothing does.
    pub(crate) fn centroid_seen(&self, view: DVec3) -> Option<DVec3> {
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for (triangle, normal) in self.mesh.triangles().zip(&self.normals) {
            let cosine = normal.dot(view);
            if cosine > GRAZING {
                let seen = triangle.area() * cosine;
                sum += seen * (triangle.a + triangle.b + triangle.c) / 3.0;
                weight += seen;
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }
}

fn bounds(vertices: &[DVec3], facets: &[[usize; 3]]) -> Result<(DVec3, DVec3), NominalError> {
    /// No part is a kilometre large; squares stay far from overflow.
    const LIMIT_MM: f64 = 1e6;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (number, facet) in facets.iter().enumerate() {
        for &index in facet {
            let vertex = *vertices.get(index).ok_or(NominalError::NoVertex {
                facet: number + 1,
                vertex: index,
                vertices: vertices.len(),
            })?;
            if !vertex.is_finite() || vertex.abs().max_element() > LIMIT_MM {
                return Err(NominalError::NotFinite { facet: number + 1 });
            }
            (low, high) = (low.min(vertex), high.max(vertex));
        }
    }
    Ok((low, high))
}

/// Number of edges with one facet, and the middle of the first; `None` where the mesh is closed.
fn orientation(
    vertices: &[DVec3],
    facets: &[[u32; 3]],
    numbers: &[usize],
) -> Result<Option<(usize, DVec3)>, NominalError> {
    // Lower and upper vertex, the facet's number, and whether it goes upwards.
    let mut edges: Vec<(u32, u32, usize, bool)> = Vec::with_capacity(3 * facets.len());
    for (facet, &number) in facets.iter().zip(numbers) {
        let [a, b, c] = *facet;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.push((from.min(to), from.max(to), number, from < to));
        }
    }
    edges.sort_unstable();
    let middle = |edge: &(u32, u32, usize, bool)| {
        let at = |index: u32| vertices.get(index as usize).copied().unwrap_or(DVec3::ZERO);
        (at(edge.0) + at(edge.1)) / 2.0
    };
    let (mut open, mut first_open) = (0, None);
    let (mut wrong, mut first_wrong) = (0, None);
    for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let Some(first) = same.first() else { continue };
        let upwards = same.iter().filter(|edge| edge.3).count();
        match same.len() {
            1 => {
                open += 1;
                first_open = first_open.or(Some(middle(first)));
            }
            // Bodies that touch along an edge have two pairs there.
            count if 2 * upwards != count => {
                wrong += 1;
                first_wrong = first_wrong.or(Some((first.2, middle(first))));
            }
            _ => {}
        }
    }
    if let Some((facet, at)) = first_wrong {
        return Err(NominalError::Orientation {
            facet,
            at_mm: at.to_array(),
            others: wrong - 1,
        });
    }
    Ok(first_open.map(|at| (open, at)))
}

/// Six times the volume enclosed.
fn volume(vertices: &[DVec3], facets: &[[u32; 3]]) -> f64 {
    let at = |index: u32| vertices.get(index as usize).copied().unwrap_or(DVec3::ZERO);
    facets
        .iter()
        .map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))))
        .sum()
}
