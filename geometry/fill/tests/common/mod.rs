//! Meshes of known surfaces, and holes in them.
#![allow(
    missing_docs,
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    clippy::panic
)]

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use fill::TriangleMesh;
use glam::DVec3;

/// A surface that is known in every place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    Sphere,
    Torus,
    Saddle,
    Ellipsoid,
    Wavy,
    Cylinder,
}

pub const RADIUS: f64 = 50.0;
pub const RING: f64 = 35.0;
pub const TUBE: f64 = 15.0;
pub const AXES: DVec3 = DVec3::new(50.0, 35.0, 25.0);
pub const WAVE: f64 = 60.0;
pub const PIPE: f64 = 25.0;

impl Shape {
    pub const ALL: [Self; 6] = [
        Self::Sphere,
        Self::Torus,
        Self::Saddle,
        Self::Ellipsoid,
        Self::Wavy,
        Self::Cylinder,
    ];

    /// How far across it is.
    pub fn size(self) -> f64 {
        100.0
    }

    /// How far a place lies off, and the normal there.
    pub fn off(self, p: DVec3) -> (f64, DVec3) {
        let height = |z: f64, slope: [f64; 2]| {
            let normal = DVec3::new(-slope[0], -slope[1], 1.0);
            ((p.z - z) / normal.length(), normal.normalize())
        };
        match self {
            Self::Sphere => (p.length() - RADIUS, p.normalize()),
            Self::Torus => {
                let flat = DVec3::new(p.x, p.y, 0.0).normalize() * RING;
                (p.distance(flat) - TUBE, (p - flat).normalize())
            }
            Self::Saddle => height(p.x * p.y / 60.0, [p.y / 60.0, p.x / 60.0]),
            Self::Ellipsoid => {
                let own = p / AXES;
                let gradient = 2.0 * own / AXES;
                let value = own.length_squared() - 1.0;
                (value / gradient.length(), gradient.normalize())
            }
            Self::Wavy => {
                let (x, y) = (TAU * p.x / WAVE, TAU * p.y / WAVE);
                let (sx, cx) = libm::sincos(x);
                let (sy, cy) = libm::sincos(y);
                let by = 4.0 * TAU / WAVE;
                height(4.0 * sx * cy, [by * cx * cy, -by * sx * sy])
            }
            Self::Cylinder => {
                let flat = DVec3::new(p.x, p.y, 0.0);
                (flat.length() - PIPE, flat.normalize())
            }
        }
    }

    /// Triangles with edges of about this length, and a place on it where holes are cut.
    pub fn mesh(self, edge: f64) -> (TriangleMesh, DVec3) {
        let count = |length: f64| (length / edge).round() as u32;
        match self {
            Self::Sphere => (
                ball(edge, DVec3::splat(RADIUS)),
                on_ball(DVec3::splat(RADIUS)),
            ),
            Self::Ellipsoid => (ball(edge, AXES), on_ball(AXES)),
            Self::Torus => {
                let at = |u: f64, v: f64| {
                    let (su, cu) = libm::sincos(TAU * u);
                    let (sv, cv) = libm::sincos(TAU * v);
                    let r = RING + TUBE * cv;
                    DVec3::new(r * cu, r * su, TUBE * sv)
                };
                let mesh = grid(count(TAU * RING), count(TAU * TUBE), [true, true], at);
                (mesh, at(0.07, 0.13))
            }
            Self::Saddle | Self::Wavy => {
                let at = |u: f64, v: f64| {
                    let flat = DVec3::new(100.0 * u - 50.0, 100.0 * v - 50.0, 0.0);
                    let (off, normal) = self.off(flat);
                    // Straight up onto it.
                    flat - DVec3::Z * (off / normal.z)
                };
                (
                    grid(count(100.0), count(100.0), [false, false], at),
                    at(0.57, 0.53),
                )
            }
            Self::Cylinder => {
                let at = |u: f64, v: f64| {
                    let (s, c) = libm::sincos(TAU * u);
                    DVec3::new(PIPE * c, PIPE * s, 100.0 * v)
                };
                (
                    grid(count(TAU * PIPE), count(100.0), [true, false], at),
                    at(0.0, 0.5),
                )
            }
        }
    }
}

/// A grid of two triangles a cell over the unit square, closed where it says so.
pub fn grid(nu: u32, nv: u32, closed: [bool; 2], at: impl Fn(f64, f64) -> DVec3) -> TriangleMesh {
    let (columns, rows) = (nu + u32::from(!closed[0]), nv + u32::from(!closed[1]));
    let mut mesh = TriangleMesh::default();
    for j in 0..rows {
        for i in 0..columns {
            let own = at(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv));
            mesh.vertices_mm.push(own.to_array());
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let id = |i: u32, j: u32| (j % rows) * columns + i % columns;
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            if (i + j) % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    mesh
}

fn on_ball(axes: DVec3) -> DVec3 {
    DVec3::new(0.3, 0.2, 1.0).normalize() * axes
}

/// An icosahedron, divided until its edges are short enough.
fn ball(edge: f64, axes: DVec3) -> TriangleMesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points = Vec::new();
    for (a, b) in [
        (1.0, golden),
        (-1.0, golden),
        (1.0, -golden),
        (-1.0, -golden),
    ] {
        points.extend([
            DVec3::new(0.0, a, b),
            DVec3::new(a, b, 0.0),
            DVec3::new(b, 0.0, a),
        ]);
    }
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for i in 0..12_u32 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let own = [i, j, k].map(|v| points[v as usize]);
                let near = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
                if near(own[0], own[1]) && near(own[1], own[2]) && near(own[2], own[0]) {
                    let is_out = (own[1] - own[0]).cross(own[2] - own[0]).dot(own[0]) > 0.0;
                    faces.push(if is_out { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    points.iter_mut().for_each(|p| *p = p.normalize());
    let mut length = 1.05 * axes.max_element();
    while length > 1.2 * edge {
        length /= 2.0;
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut finer = Vec::new();
        for &[a, b, c] in &faces {
            let mut middle = |u: u32, v: u32| {
                *middles.entry((u.min(v), u.max(v))).or_insert_with(|| {
                    points.push((points[u as usize] + points[v as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    TriangleMesh {
        vertices_mm: points.into_iter().map(|p| (p * axes).to_array()).collect(),
        triangles: faces,
    }
}

/// Leaves out triangles with a corner for which this holds, and vertices that nobody has then.
pub fn cut(mesh: &TriangleMesh, is_out: impl Fn(DVec3) -> bool) -> TriangleMesh {
    let at = |v: u32| DVec3::from_array(mesh.vertices_mm[v as usize]);
    let kept = mesh
        .triangles
        .iter()
        .filter(|t| !t.iter().any(|&v| is_out(at(v))));
    compacted(mesh, kept.copied().collect())
}

pub fn compacted(mesh: &TriangleMesh, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    let mut new_of: HashMap<u32, u32> = HashMap::new();
    let mut out = TriangleMesh::default();
    for triangle in triangles {
        out.triangles.push(triangle.map(|v| {
            *new_of.entry(v).or_insert_with(|| {
                out.vertices_mm.push(mesh.vertices_mm[v as usize]);
                out.vertices_mm.len() as u32 - 1
            })
        }));
    }
    out
}

/// A ball-shaped hole of a diameter, as a share of the size; on the cylinder a window that reaches so
/// far around that nothing sees it whole.
pub fn with_hole(shape: Shape, edge: f64, share: f64) -> (TriangleMesh, f64) {
    let (mesh, centre) = shape.mesh(edge);
    let across = share * shape.size();
    if shape == Shape::Cylinder {
        let (half, high) = (share * 2.0 * PI, 0.5 * across);
        let is_out = |p: DVec3| libm::atan2(p.y, p.x).abs() < half && (p.z - 50.0).abs() < high;
        return (cut(&mesh, is_out), across);
    }
    (cut(&mesh, |p| p.distance(centre) < 0.5 * across), across)
}

/// Noise along the normals.
pub fn noisy(mesh: &mut TriangleMesh, shape: Shape, sigma: f64, seed: u64) {
    use rand_core::{Rng, SeedableRng};
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    for place in &mut mesh.vertices_mm {
        let own = DVec3::from_array(*place);
        let (a, b): (f64, f64) = (uniform(), uniform());
        let normal = (-2.0 * libm::log(1.0 - a)).sqrt() * libm::cos(TAU * b);
        *place = (own + sigma * normal * shape.off(own).1).to_array();
    }
}

/// Every edge has two triangles that run along it in opposite senses.
pub fn is_watertight(mesh: &TriangleMesh) -> bool {
    let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for side in [(a, b), (b, c), (c, a)] {
            *sides.entry(side).or_default() += 1;
        }
    }
    sides
        .iter()
        .all(|(&(a, b), &count)| count == 1 && sides.get(&(b, a)) == Some(&1))
}

/// Numbers between 0 and 1 that follow from a seed.
pub fn uniform(seed: u64) -> impl FnMut() -> f64 {
    use rand_core::{Rng, SeedableRng};
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    move || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A hole of a diameter, as a share of the size, where a seed puts it: anywhere on what is closed, and
/// so far inside of sheets that it does not reach their borders.
pub fn with_hole_by(shape: Shape, edge: f64, share: f64, seed: u64) -> (TriangleMesh, f64) {
    let mut uniform = uniform(seed);
    let (mesh, _) = shape.mesh(edge);
    let across = share * shape.size();
    let inside = |p: DVec3| match shape {
        Shape::Saddle | Shape::Wavy => p.x.abs().max(p.y.abs()) < 48.0 - across,
        Shape::Cylinder => (p.z - 50.0).abs() < 48.0 - across,
        _ => true,
    };
    let centre = loop {
        let k = (uniform() * mesh.vertices_mm.len() as f64) as usize;
        let own = DVec3::from_array(mesh.vertices_mm[k]);
        if inside(own) {
            break own;
        }
    };
    if shape == Shape::Cylinder {
        // As far around as leaves the same share of the whole turn twice over.
        let (half, high) = (share * 2.0 * PI, 0.5 * across);
        let middle = libm::atan2(centre.y, centre.x);
        let is_out = |p: DVec3| {
            let turn = libm::remainder(libm::atan2(p.y, p.x) - middle, TAU);
            turn.abs() < half && (p.z - centre.z).abs() < high
        };
        return (cut(&mesh, is_out), across);
    }
    (cut(&mesh, |p| p.distance(centre) < 0.5 * across), across)
}
