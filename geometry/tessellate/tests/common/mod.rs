//! Models put together by hand, and what must hold of all triangles.
#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::panic)]

use nurbs::{PatchSurface, PiecewiseCubic};
use reconstruct::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};
use tessellate::Mesh;

pub(crate) type Point = [f64; 2];

/// A surface over a square of this half side, through values at most 0.1 mm apart.
pub(crate) fn surface(half_mm: f64, z: impl Fn(f64, f64) -> f64) -> PatchSurface {
    let count = (half_mm / 0.3).ceil() as usize * 2;
    let third = 2.0 * half_mm / (3 * count) as f64;
    let breaks: Vec<f64> = (0..=count)
        .map(|k| 3.0 * third * k as f64 - half_mm)
        .collect();
    PatchSurface::through_thirds(breaks.clone(), breaks, |i, j| {
        z(third * i as f64 - half_mm, third * j as f64 - half_mm)
    })
    .unwrap()
}

pub(crate) fn line(a: Point, b: Point) -> PiecewiseCubic<2> {
    let length = ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
    PiecewiseCubic::line(a, b, length).unwrap()
}

/// An arc of a circle about a centre, in pieces of about 10 degrees.
pub(crate) fn arc(centre: Point, radius: f64, from: f64, to: f64) -> PiecewiseCubic<2> {
    let count = ((to - from).abs() / 0.17).ceil().max(1.0) as usize;
    let (turn, width) = (
        (to - from) / count as f64,
        radius * (to - from).abs() / count as f64,
    );
    let pieces = (0..count).map(|k| {
        let at = |third: f64| {
            let (sin, cos) = libm::sincos(from + turn * (k as f64 + third / 3.0));
            [centre[0] + radius * cos, centre[1] + radius * sin]
        };
        let points = [at(0.0), at(1.0), at(2.0), at(3.0)];
        PiecewiseCubic::through_thirds(0.0, width, &points)
            .unwrap()
            .pieces[0]
    });
    let pieces = pieces.collect();
    let breaks = (0..=count).map(|k| width * k as f64).collect();
    PiecewiseCubic::new(breaks, pieces).unwrap()
}

/// Puts models together; edges that end in one place share a vertex.
#[derive(Default)]
pub(crate) struct Builder {
    pub(crate) model: Model,
}

impl Builder {
    fn vertex(&mut self, [x_mm, y_mm]: Point) -> VertexId {
        let near = |v: &Vertex| (v.x_mm - x_mm).abs() + (v.y_mm - y_mm).abs() < 1e-9;
        let found = self.model.vertices.iter().position(near);
        VertexId(found.unwrap_or_else(|| {
            self.model.vertices.push(Vertex { x_mm, y_mm });
            self.model.vertices.len() - 1
        }))
    }

    pub(crate) fn edge(&mut self, kind: EdgeKind, path: PiecewiseCubic<2>) -> usize {
        let (start, end) = (self.vertex(path.start()), self.vertex(path.end()));
        self.model.edges.push(Edge {
            start,
            end,
            kind,
            origin: EdgeOrigin::Measured,
            path,
        });
        self.model.edges.len() - 1
    }

    /// Silhouettes around a polygon.
    pub(crate) fn polygon(&mut self, corners: &[Point]) -> Vec<(usize, bool)> {
        let next = |k: usize| corners[(k + 1) % corners.len()];
        let sides = corners.iter().enumerate();
        sides
            .map(|(k, &a)| (self.edge(EdgeKind::Silhouette, line(a, next(k))), false))
            .collect()
    }

    /// A face with these loops, the outer one first, of edges that are reversed or not.
    pub(crate) fn face(&mut self, surface: &PatchSurface, loops: &[Vec<(usize, bool)>]) {
        let loops = loops.iter().map(|border| Loop {
            coedges: border
                .iter()
                .map(|&(edge, reversed)| self.coedge(surface, edge, reversed))
                .collect(),
        });
        let mut loops: Vec<Loop> = loops.collect();
        let number = self.model.faces.len() + 1;
        self.model.faces.push(Face {
            name: format!("face-{number}"),
            region: number as u16,
            surface: Surface::Patches(surface.clone()),
            form: None,
            outer: loops.remove(0),
            inner: loops,
        });
    }

    fn coedge(&self, surface: &PatchSurface, edge: usize, reversed: bool) -> Coedge {
        let path = &self.model.edges[edge].path;
        let parameter_curve = if reversed {
            path.reversed()
        } else {
            path.clone()
        };
        let pieces = parameter_curve.breaks.windows(2).map(|pair| {
            let at = |third: f64| {
                let t = pair[0] + (pair[1] - pair[0]) * third / 3.0;
                let [x, y] = parameter_curve.evaluate(t);
                surface.evaluate(x, y)
            };
            let points = [at(0.0), at(1.0), at(2.0), at(3.0)];
            let piece = PiecewiseCubic::through_thirds(pair[0], pair[1], &points).unwrap();
            piece.pieces[0]
        });
        Coedge {
            edge: EdgeId(edge),
            reversed,
            space_curve: PiecewiseCubic::new(parameter_curve.breaks.clone(), pieces.collect())
                .unwrap(),
            parameter_curve,
        }
    }
}

/// What is found by looking at all triangles.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) free_edges: usize,
    pub(crate) least_angle_rad: f64,
    /// Triangles with an angle of less than 20 degrees.
    pub(crate) slim: usize,
}

/// No triangle is turned over or flat, no side has more than two triangles or one of them twice,
/// and indices and normals are what they are said to be.
pub(crate) fn sound(mesh: &Mesh) -> Found {
    let mut least_angle_rad = f64::INFINITY;
    let mut slim = 0;
    let mut sides = std::collections::BTreeMap::new();
    for face in &mesh.faces {
        for corner in &face.corners {
            let length = corner.normal.iter().map(|c| c * c).sum::<f64>();
            assert!((length - 1.0).abs() < 1e-12 && corner.normal[2] > 0.0);
        }
        for triangle in face.triangles() {
            let [a, b, c] = mesh.corners_mm(triangle);
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(twice > 0.0, "{} turned over: {a:?} {b:?} {c:?}", face.name);
            let least = angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b));
            least_angle_rad = least_angle_rad.min(least);
            slim += usize::from(least < 20.0_f64.to_radians());
            for k in 0..3 {
                // In one sense only, so that neighbours agree on which side is which.
                let side = [triangle[k], triangle[(k + 1) % 3]];
                assert!(sides.insert(side, ()).is_none(), "{}: {side:?}", face.name);
            }
        }
    }
    let is_free = |[a, b]: &[u32; 2]| !sides.contains_key(&[*b, *a]);
    let free_edges = sides.keys().filter(|side| is_free(side)).count();
    assert_eq!(free_edges, mesh.free_edges());
    Found {
        free_edges,
        least_angle_rad,
        slim,
    }
}

fn angle(at: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let (u, v): ([f64; 3], [f64; 3]) = (
        core::array::from_fn(|d| a[d] - at[d]),
        core::array::from_fn(|d| b[d] - at[d]),
    );
    let dot = u.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
    let length = |w: [f64; 3]| w.iter().map(|c| c * c).sum::<f64>().sqrt();
    libm::acos((dot / (length(u) * length(v))).clamp(-1.0, 1.0))
}

/// Places of a triangle: its middle, and the middles of its sides.
pub(crate) fn places(corners: [[f64; 3]; 3]) -> [[f64; 3]; 4] {
    let shares = [
        [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.5],
        [0.5, 0.0, 0.5],
    ];
    shares.map(|s| {
        core::array::from_fn(|d| s[0] * corners[0][d] + s[1] * corners[1][d] + s[2] * corners[2][d])
    })
}
