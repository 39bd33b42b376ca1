//! Bodies in the place where they stand.
//!
//! Local frames have z upwards from the ground that a body stands on.

use core::f64::consts::TAU;

use glam::{DMat3, DVec3};
use sim_scanner::scene::{Body, ConvexSolid, Mesh, Surface};

/// A rotation and then a shift, millimetres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose {
    pub(super) turn: DMat3,
    pub(super) shift_mm: DVec3,
}

impl Pose {
    /// Turned about z, and moved.
    pub(super) fn upright(yaw_rad: f64, shift_mm: DVec3) -> Self {
        Self {
            turn: DMat3::from_rotation_z(yaw_rad),
            shift_mm,
        }
    }

    /// The local z axis brought to `up` after a turn about it.
    pub(super) fn leaning(yaw_rad: f64, up: DVec3, shift_mm: DVec3) -> Self {
        let lean = glam::DQuat::from_rotation_arc(DVec3::Z, up);
        Self {
            turn: DMat3::from_quat(lean) * DMat3::from_rotation_z(yaw_rad),
            shift_mm,
        }
    }

    /// First `inner`, then this.
    pub(super) fn after(&self, inner: &Self) -> Self {
        Self {
            turn: self.turn * inner.turn,
            shift_mm: self.point(inner.shift_mm),
        }
    }

    pub(super) fn point(&self, p: DVec3) -> DVec3 {
        self.turn * p + self.shift_mm
    }

    fn plane(&self, (normal, offset_mm): (DVec3, f64)) -> (DVec3, f64) {
        let normal = (self.turn * normal).normalize();
        (normal, offset_mm + normal.dot(self.shift_mm))
    }
}

/// Half-space `normal . p <= offset`.
pub(super) type Half = (DVec3, f64);

pub(super) fn half(normal: DVec3, offset_mm: f64) -> Half {
    (normal.normalize(), offset_mm)
}

/// The common part of half-spaces; `None` where it is empty or not bounded.
pub(super) fn polyhedron(halves: &[Half], pose: &Pose) -> Option<Body> {
    let planes: Vec<Half> = halves.iter().map(|h| pose.plane(*h)).collect();
    let mut corners = Vec::new();
    for (a, p) in planes.iter().enumerate() {
        for (b, q) in planes.iter().enumerate().skip(a + 1) {
            for r in planes.iter().skip(b + 1) {
                let matrix = DMat3::from_cols(p.0, q.0, r.0).transpose();
                if matrix.determinant().abs() < 1e-9 {
                    continue;
                }
                let corner = matrix.inverse() * DVec3::new(p.1, q.1, r.1);
                if planes.iter().all(|(n, d)| n.dot(corner) <= d + 1e-6) {
                    corners.push(corner);
                }
            }
        }
    }
    let low = corners.iter().fold(DVec3::INFINITY, |l, c| l.min(*c));
    let high = corners.iter().fold(DVec3::NEG_INFINITY, |h, c| h.max(*c));
    if corners.len() < 4 || (high - low).max_element() > 1000.0 {
        return None;
    }
    let faces = planes
        .iter()
        .map(|&(normal, offset_mm)| Surface::Plane { normal, offset_mm })
        .collect();
    Some(Body::Solid(
        ConvexSolid::new(faces).with_extent_mm(low, high),
    ))
}

/// A box on the ground around the local origin.
pub(super) fn block(half_x: f64, half_y: f64, height: f64) -> Vec<Half> {
    vec![
        half(DVec3::X, half_x),
        half(DVec3::NEG_X, half_x),
        half(DVec3::Y, half_y),
        half(DVec3::NEG_Y, half_y),
        half(DVec3::Z, height),
        half(DVec3::NEG_Z, 0.0),
    ]
}

/// A frustum of a regular pyramid: sides lean in by an angle from the upright.
pub(super) fn frustum(sides: u64, reach: f64, lean_rad: f64, height: f64) -> Vec<Half> {
    let (sin, cos) = libm::sincos(lean_rad);
    let mut halves: Vec<Half> = (0..sides)
        .map(|k| {
            let (s, c) = libm::sincos(TAU * k as f64 / sides as f64);
            half(DVec3::new(c * cos, s * cos, sin), reach * cos)
        })
        .collect();
    halves.push(half(DVec3::Z, height));
    halves.push(half(DVec3::NEG_Z, 0.0));
    halves
}

/// A roof over a rectangle: two slopes that meet in a ridge along y.
pub(super) fn roof(half_x: f64, half_y: f64, eaves: f64, slope_rad: f64) -> Vec<Half> {
    let (sin, cos) = libm::sincos(slope_rad);
    let mut halves = block(half_x, half_y, eaves + half_x * sin / cos);
    for side in [1.0, -1.0] {
        halves.push(half(
            DVec3::new(side * sin, 0.0, cos),
            half_x * sin + eaves * cos,
        ));
    }
    halves
}

/// Planes cut off at flat ends, with a round side between.
pub(super) fn round(
    side: Surface,
    ends: &[Half],
    (low, high): (DVec3, DVec3),
    pose: &Pose,
) -> Body {
    let side = match side {
        Surface::Cylinder {
            base_mm,
            axis,
            radius_mm,
        } => Surface::Cylinder {
            base_mm: pose.point(base_mm),
            axis: (pose.turn * axis).normalize(),
            radius_mm,
        },
        Surface::Cone {
            apex_mm,
            axis,
            half_angle_rad,
        } => Surface::Cone {
            apex_mm: pose.point(apex_mm),
            axis: (pose.turn * axis).normalize(),
            half_angle_rad,
        },
        Surface::Sphere {
            centre_mm,
            radius_mm,
        } => Surface::Sphere {
            centre_mm: pose.point(centre_mm),
            radius_mm,
        },
        Surface::Plane { normal, offset_mm } => {
            let (normal, offset_mm) = pose.plane((normal, offset_mm));
            Surface::Plane { normal, offset_mm }
        }
    };
    let mut faces = vec![side];
    faces.extend(ends.iter().map(|end| {
        let (normal, offset_mm) = pose.plane(*end);
        Surface::Plane { normal, offset_mm }
    }));
    let corners = (0..8).map(|k: u32| {
        let pick = |bit: u32, l: f64, h: f64| if k & bit == 0 { l } else { h };
        let corner = DVec3::new(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        );
        pose.point(corner)
    });
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), c| {
        (l.min(c), h.max(c))
    });
    Body::Solid(ConvexSolid::new(faces).with_extent_mm(low, high))
}

/// A surface over a parameter rectangle of `u` by `v` steps as one face, both ends included.
pub(super) fn sheet(
    (u, v): (usize, usize),
    point: impl Fn(f64, f64) -> DVec3,
    pose: &Pose,
) -> Option<Body> {
    let mut points = Vec::with_capacity((u + 1) * (v + 1));
    for i in 0..=u {
        for j in 0..=v {
            points.push(pose.point(point(i as f64 / u as f64, j as f64 / v as f64)));
        }
    }
    let at = |i: usize, j: usize| i * (v + 1) + j;
    let cells = (0..u).flat_map(|i| (0..v).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        [[a, b, c], [a, c, d]]
    });
    let mesh = Mesh::one_face(points, triangles).ok()?;
    Some(Body::Mesh(Box::new(mesh)))
}
