//! Surfaces that a motion sweeps of a profile: of extrusion, and of revolution.
//!
//! ```text
//! samples --> normals (planes of blocks) --> motions --> fitted with their profiles, of ever more
//!         spans --> held against polynomials and against what is left in blocks --> SweptFit
//! ```
//!
//! The profile is a cubic spline in the plane that the motion sweeps, its spans as many as the
//! samples are worth; motion and profile are fitted together, so that the uncertainties of the
//! motion include what the profile could make up for.

mod fit;
mod motion;
mod motions;
mod profile;
mod surface;
mod verdict;

pub use fit::SweptFit;
pub use motion::{MOST_FREE, Motion, Placed, Sweep};
pub use motions::{Normal, motions};
pub use surface::Swept;
pub use verdict::swept;
