//! What a surface is, where it is of a kind that engineers know.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::shape::Shape;
use crate::sweep::Swept;

/// A surface that is told by its numbers, or by a profile and what sweeps it.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A plane, cylinder, cone, sphere or torus.
    Shape(Shape),
    /// A surface of extrusion or revolution. It is shared, for its profile may be long.
    Swept(Arc<Swept>),
}

impl Form {
    /// The shape, if it is one.
    #[must_use]
    pub fn shape(&self) -> Option<&Shape> {
        match self {
            Self::Shape(shape) => Some(shape),
            Self::Swept(_) => None,
        }
    }

    /// As [`Shape::distance_mm`] and [`Swept::distance_mm`].
    #[must_use]
    pub fn distance_mm(&self, point_mm: &Vector3<f64>) -> f64 {
        match self {
            Self::Shape(shape) => shape.distance_mm(point_mm),
            Self::Swept(swept) => swept.distance_mm(point_mm),
        }
    }

    /// As [`Shape::normal`].
    #[must_use]
    pub fn normal(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Shape(shape) => shape.normal(point_mm),
            Self::Swept(swept) => swept.normal(point_mm),
        }
    }

    /// As [`Shape::z_mm`].
    #[must_use]
    pub fn z_mm(&self, x_mm: f64, y_mm: f64, near_mm: f64) -> Option<f64> {
        match self {
            Self::Shape(shape) => shape.z_mm(x_mm, y_mm, near_mm),
            Self::Swept(swept) => swept.z_mm(x_mm, y_mm, near_mm),
        }
    }

    /// Its name in reports.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::Shape(shape) => shape.family().as_str(),
            Self::Swept(swept) => swept.as_str(),
        }
    }
}

impl From<Shape> for Form {
    fn from(shape: Shape) -> Self {
        Self::Shape(shape)
    }
}

impl From<Swept> for Form {
    fn from(swept: Swept) -> Self {
        Self::Swept(Arc::new(swept))
    }
}
