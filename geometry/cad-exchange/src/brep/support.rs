//! What the edges of a face are to lie on.

use nalgebra::Vector3;
use nurbs::PatchSurface;
use shapes::{Shape, Swept};

/// A surface that points are put on.
#[derive(Debug, Clone, Copy)]
pub(super) enum Support<'a> {
    /// By its numbers.
    Shape(Shape),
    /// By its profile.
    Swept(&'a Swept),
    /// A graph over x and y.
    Patches(&'a PatchSurface),
}

impl Support<'_> {
    /// It is written by its numbers or its profile: edges must lie on it, and can anywhere.
    pub(super) fn is_known(&self) -> bool {
        matches!(self, Self::Shape(_) | Self::Swept(_))
    }

    /// How far beyond it a place is, on the side of its normal; beside patches about that.
    pub(super) fn distance_mm(&self, place: &Vector3<f64>) -> f64 {
        match self {
            Self::Shape(shape) => shape.distance_mm(place),
            Self::Swept(swept) => swept.distance_mm(place),
            Self::Patches(patches) => {
                (place.z - patches.z(place.x, place.y)) * self.normal(place).z
            }
        }
    }

    /// Unit normal beside a place.
    pub(super) fn normal(&self, place: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Shape(shape) => shape.normal(place),
            Self::Swept(swept) => swept.normal(place),
            Self::Patches(patches) => patches.normal(place.x, place.y).into(),
        }
    }
}
