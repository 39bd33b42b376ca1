//! Spline curves and surfaces.
//!
//! Two families live here: B-splines, in which surfaces are fitted, and piecewise cubic
//! polynomials in power form, in which Shim & Lee 1995 (section V) write them to IGES
//! as entities 112 and 114.

pub mod banded;
mod closest;
pub mod curve;
mod edit;
pub mod fit;
pub mod knots;
pub mod piecewise;
mod rational;
pub mod surface;
pub mod uniform;

pub use banded::{BandedCholesky, BandedMatrix, Singular};
pub use closest::Closest;
pub use curve::{BSplineCurve, ControlCountError};
pub use edit::Removal;
pub use fit::{Observation, TensorSpline, thirds};
pub use knots::{Basis, KnotError, KnotVector, MAX_DEGREE};
pub use piecewise::{PatchSurface, PiecewiseCubic, PiecewiseError, cubic_through_thirds};
pub use rational::{RationalCurve, RationalError, RationalSurface};
pub use surface::BSplineSurface;
pub use uniform::{Parameter, UniformSpline};
