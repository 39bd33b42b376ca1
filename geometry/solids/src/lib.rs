//! Faces as any CAD program has them, and triangles of them.
//!
//! Unlike the model of a scan, whose faces are graphs over a plane, these close around a part:
//! cylinders with or without a seam, whole spheres, loops around an axis. Every edge is divided
//! once, for all faces that it bounds; each face is then filled in the plane of its surface's
//! parameters, unrolled from a line that no edge crosses other than in one of its points.
//!
//! ```text
//! edges --> Division (each once) --> Chart of a face: parameters, unrolled
//!       --> triangles to the left of its loops --> points where the surface bends --> Facets
//! ```

mod body;
mod chart;
mod curve;
mod division;
mod face;
mod facets;
mod inverse;
mod orient;
mod spline;
mod surface;

pub use body::{Body, BodyError, Edge, EdgeUse, Face};
pub use curve::Curve;
pub use facets::{FacetSettings, Facets, facets};
pub use spline::{Knots, SplineCurve, SplineSurface};
pub use surface::{Frame, Surface};

/// What a value that comes again after a period is from `first` on.
fn wrapped(value: f64, first: f64, period: f64) -> f64 {
    first + libm::fmod(libm::fmod(value - first, period) + period, period)
}

/// A point or direction in space, millimetres.
pub type Point = nalgebra::Vector3<f64>;
