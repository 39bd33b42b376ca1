//! Surfaces that are known, and samples of them.

#![allow(dead_code, reason = "each test file takes what it needs")]

use nalgebra::Vector3;
use shapes::{Cone, Cylinder, Plane, Sample, Shape, Sphere, Torus};

/// Standard deviation of the samples along the normal, millimetres.
pub(crate) const NOISE_MM: f64 = 0.05;

/// Random numbers, the same in every run.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal, by the sum of twelve.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn tilted() -> Vector3<f64> {
    Vector3::new(0.8, 0.5, 0.3).normalize()
}

/// A place on a surface of revolution: so far along its axis, off it, and around it.
fn around(origin: Vector3<f64>, axis: Vector3<f64>, up: f64, out: f64, angle: f64) -> Vector3<f64> {
    // The direction towards +z comes at angle 0.
    let towards = (Vector3::z() - axis * axis.z).normalize();
    let aside = axis.cross(&towards);
    origin + axis * up + (towards * libm::cos(angle) + aside * libm::sin(angle)) * out
}

/// A shape and how one of its points comes from two numbers between 0 and 1.
pub(crate) type Case = (Shape, fn(&Shape, f64, f64) -> Vector3<f64>);

pub(crate) fn cases() -> Vec<Case> {
    vec![
        (
            Shape::Plane(Plane {
                point_mm: Vector3::new(1.0, 2.0, 3.0),
                normal: Vector3::new(0.3, -0.2, 0.9).normalize(),
            }),
            |shape, s, t| {
                let Shape::Plane(plane) = shape else {
                    unreachable!("as above");
                };
                let (x, y) = (40.0 * s, 30.0 * t);
                let n = plane.normal;
                Vector3::new(x, y, (n.dot(&plane.point_mm) - n.x * x - n.y * y) / n.z)
            },
        ),
        (
            Shape::Sphere(Sphere {
                centre_mm: Vector3::new(5.0, -3.0, 10.0),
                radius_mm: 20.0,
                is_hollow: false,
            }),
            |shape, s, t| {
                let Shape::Sphere(sphere) = shape else {
                    unreachable!("as above");
                };
                let (up, angle) = (1.0 - 0.3 * s, core::f64::consts::TAU * t);
                around(
                    sphere.centre_mm,
                    Vector3::z() + Vector3::x() * 1e-9,
                    sphere.radius_mm * up,
                    sphere.radius_mm * (1.0 - up * up).sqrt(),
                    angle,
                )
            },
        ),
        (
            Shape::Cylinder(Cylinder {
                point_mm: Vector3::new(0.0, 4.0, -10.0),
                axis: tilted(),
                radius_mm: 12.0,
                is_hollow: false,
            }),
            |shape, s, t| {
                let Shape::Cylinder(c) = shape else {
                    unreachable!("as above");
                };
                around(c.point_mm, c.axis, 40.0 * s, c.radius_mm, 2.0 * t - 1.0)
            },
        ),
        (
            Shape::Cone(Cone {
                apex_mm: Vector3::new(0.0, 4.0, -10.0),
                axis: tilted(),
                half_angle_rad: 0.4,
                is_hollow: false,
            }),
            |shape, s, t| {
                let Shape::Cone(c) = shape else {
                    unreachable!("as above");
                };
                let up = 20.0 + 30.0 * s;
                let out = up * libm::tan(c.half_angle_rad);
                around(c.apex_mm, c.axis, up, out, 2.0 * t - 1.0)
            },
        ),
        (
            Shape::Torus(Torus {
                centre_mm: Vector3::new(2.0, 4.0, -1.0),
                axis: Vector3::new(0.1, 0.2, 1.0).normalize(),
                radius_mm: 25.0,
                tube_mm: 6.0,
                is_hollow: false,
            }),
            |shape, s, t| {
                let Shape::Torus(torus) = shape else {
                    unreachable!("as above");
                };
                let tube = 0.3 + 1.2 * s;
                let (sin, cos) = libm::sincos(tube);
                let axis = torus.axis;
                let aside = axis.cross(&Vector3::y()).normalize();
                let ahead = aside.cross(&axis);
                let turn = 2.2 * t;
                let out = torus.radius_mm + torus.tube_mm * cos;
                torus.centre_mm
                    + axis * (torus.tube_mm * sin)
                    + (aside * libm::cos(turn) + ahead * libm::sin(turn)) * out
            },
        ),
    ]
}

/// Samples on a surface, moved along its normal by noise.
pub(crate) fn samples((shape, at): &Case, count: usize, seed: u64) -> Vec<Sample> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1));
    (0..count)
        .map(|_| {
            let point = at(shape, random.uniform(), random.uniform());
            let slope = Vector3::from_fn(|k, _| {
                let mut step = Vector3::zeros();
                step[k] = 1e-5;
                (shape.distance_mm(&(point + step)) - shape.distance_mm(&(point - step))) / 2e-5
            });
            Sample {
                point_mm: point + slope.normalize() * (NOISE_MM * random.normal()),
                ray: slope.normalize(),
                sigma_mm: NOISE_MM,
            }
        })
        .collect()
}
