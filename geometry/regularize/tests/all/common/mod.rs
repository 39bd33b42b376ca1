//! Shapes as fits would leave them: true ones with noise of a known covariance.

use nalgebra::{Matrix3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use regularize::{Fitted, Regularized, Settings, regularize};
use shapes::{Cone, Cylinder, Joint, Plane, Shape, Sphere, Torus};

/// Size of all parts here.
pub(crate) const SIZE_MM: f64 = 100.0;

/// How well a shape is known.
#[derive(Clone, Copy)]
pub(crate) struct Known {
    pub(crate) turn_rad: f64,
    pub(crate) place_mm: f64,
    pub(crate) size: f64,
}

pub(crate) const WELL: Known = Known {
    turn_rad: 5e-4,
    place_mm: 0.004,
    size: 0.003,
};

pub(crate) struct Chance(Xoshiro256PlusPlus);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Evenly from 0 to 1.
    pub(crate) fn even(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.even()
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.even())).sqrt();
        radius * libm::cos(core::f64::consts::TAU * self.even())
    }

    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        loop {
            let way = Vector3::from_fn(|_, _| self.normal());
            if let Some(way) = way.try_normalize(1e-9) {
                return way;
            }
        }
    }

    pub(crate) fn place(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-0.3, 0.3) * SIZE_MM)
    }

    fn across(&mut self, direction: &Vector3<f64>, deviation: f64) -> Vector3<f64> {
        let by = Vector3::from_fn(|_, _| self.normal() * deviation);
        by - direction * by.dot(direction)
    }

    /// A shape as measured.
    pub(crate) fn measured(&mut self, label: u16, shape: &Shape, known: Known) -> Fitted {
        let mut shape = *shape;
        let all = |this: &mut Self| Vector3::from_fn(|_, _| this.normal() * known.place_mm);
        match &mut shape {
            Shape::Plane(plane) => {
                plane.point_mm += plane.normal * (self.normal() * known.place_mm);
                plane.normal += self.across(&plane.normal, known.turn_rad);
                plane.normal.normalize_mut();
            }
            Shape::Sphere(sphere) => {
                sphere.centre_mm += all(self);
                sphere.radius_mm += self.normal() * known.size;
            }
            Shape::Cylinder(cylinder) => {
                cylinder.point_mm += self.across(&cylinder.axis, known.place_mm);
                cylinder.axis += self.across(&cylinder.axis, known.turn_rad);
                cylinder.axis.normalize_mut();
                cylinder.radius_mm += self.normal() * known.size;
            }
            Shape::Cone(cone) => {
                cone.apex_mm += all(self);
                cone.axis += self.across(&cone.axis, known.turn_rad);
                cone.axis.normalize_mut();
                cone.half_angle_rad += self.normal() * known.turn_rad;
            }
            Shape::Torus(torus) => {
                torus.centre_mm += all(self);
                torus.axis += self.across(&torus.axis, known.turn_rad);
                torus.axis.normalize_mut();
                torus.radius_mm += self.normal() * known.size;
                torus.tube_mm += self.normal() * known.size;
            }
        }
        fitted(label, shape, known)
    }
}

/// A shape that is as it is, known so well.
pub(crate) fn fitted(label: u16, shape: Shape, known: Known) -> Fitted {
    let all = Matrix3::identity();
    let beside = |way: &Vector3<f64>| all - way * way.transpose();
    let (turns, places, sizes) = match &shape {
        Shape::Plane(p) => (
            beside(&p.normal),
            p.normal * p.normal.transpose(),
            [0.0, 0.0, 0.0],
        ),
        Shape::Sphere(_) => (Matrix3::zeros(), all, [known.size, 0.0, 0.0]),
        Shape::Cylinder(c) => (beside(&c.axis), beside(&c.axis), [known.size, 0.0, 0.0]),
        Shape::Cone(c) => (beside(&c.axis), all, [0.0, 0.0, known.turn_rad]),
        Shape::Torus(t) => (beside(&t.axis), all, [known.size, known.size, 0.0]),
    };
    let mut joint = Joint::zeros();
    joint
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(turns * known.turn_rad.powi(2)));
    joint
        .fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(places * known.place_mm.powi(2)));
    for (k, size) in sizes.into_iter().enumerate() {
        joint[(6 + k, 6 + k)] = size * size;
    }
    Fitted {
        label,
        shape,
        joint,
    }
}

pub(crate) fn plane(normal: Vector3<f64>, point_mm: Vector3<f64>) -> Shape {
    let normal = normal.normalize();
    Shape::Plane(Plane { point_mm, normal })
}

pub(crate) fn cylinder(axis: Vector3<f64>, point_mm: Vector3<f64>, radius_mm: f64) -> Shape {
    Shape::Cylinder(Cylinder {
        point_mm,
        axis: axis.normalize(),
        radius_mm,
        is_hollow: true,
    })
}

pub(crate) fn sphere(centre_mm: Vector3<f64>, radius_mm: f64) -> Shape {
    Shape::Sphere(Sphere {
        centre_mm,
        radius_mm,
        is_hollow: false,
    })
}

pub(crate) fn cone(axis: Vector3<f64>, apex_mm: Vector3<f64>, half_angle_deg: f64) -> Shape {
    Shape::Cone(Cone {
        apex_mm,
        axis: axis.normalize(),
        half_angle_rad: half_angle_deg.to_radians(),
        is_hollow: false,
    })
}

pub(crate) fn torus(
    axis: Vector3<f64>,
    centre_mm: Vector3<f64>,
    radius_mm: f64,
    tube_mm: f64,
) -> Shape {
    Shape::Torus(Torus {
        centre_mm,
        axis: axis.normalize(),
        radius_mm,
        tube_mm,
        is_hollow: false,
    })
}

/// As [`regularize`], with the settings by default.
pub(crate) fn found(shapes: &[Fitted]) -> Regularized {
    regularize(shapes, &[], SIZE_MM, &Settings::default()).expect("they are within their limits")
}

/// Direction of a plane or an axis.
pub(crate) fn direction(shape: &Shape) -> Vector3<f64> {
    match shape {
        Shape::Plane(p) => p.normal,
        Shape::Sphere(_) => Vector3::zeros(),
        Shape::Cylinder(c) => c.axis,
        Shape::Cone(c) => c.axis,
        Shape::Torus(t) => t.axis,
    }
}

/// The shapes afterwards, those that nothing ties as they were.
pub(crate) fn after(shapes: &[Fitted], found: &Regularized) -> Vec<Shape> {
    let one = |own: &Fitted| {
        let mut adjusted = found.adjusted.iter();
        let adjusted = adjusted.find(|adjusted| adjusted.label == own.label);
        adjusted.map_or(own.shape, |adjusted| adjusted.shape)
    };
    shapes.iter().map(one).collect()
}
