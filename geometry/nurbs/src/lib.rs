//! Spline curves and surfaces.
//!
//! Two families live here: B-splines, in which surfaces are fitted, and piecewise cubic
//! polynomials in power form, in which Shim & Lee 1995 (section V) write them to IGES
//! as entities 112 and 114.

pub mod piecewise;

pub use piecewise::{PatchSurface, PiecewiseCubic};
