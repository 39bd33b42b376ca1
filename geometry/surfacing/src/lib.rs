//! One B-spline surface over a uniform grid of heights, after Y. H. Koo and D. J. Lee, *A study
//! on the generation of B-spline surface by 3D measurement data*.
//!
//! ```text
//! HeightGrid --> fairing (if asked for) --> character lines --> knots --> least squares --> pieces
//! ```
//!
//! - [`grid`]: the data, with a mask.
//! - [`fairing`]: points moved within a bound.
//! - [`character`]: lines on which pieces of the surface meet.
//! - [`knots`]: the paper's three placements; [`optimal`]: ours.
//! - [`surface`]: all of it in order, with a report.
//!
//! With optimal knots the surface is drawn within the tolerance where that of least squares is
//! beyond it.
//!
//! The surface is cubic and open in both directions (section 4); x and y are its parameters,
//! so that its control points lie at the knots' averages and only their z is fitted.

mod axis;
pub mod character;
pub mod error;
pub mod fairing;
mod fit;
pub mod grid;
mod infill;
pub mod knots;
mod normal;
mod optimal;
mod parted;
mod problem;
pub mod surface;
mod within;

pub use axis::Breaks;
pub use character::{CharacterLine, Features, LineKind, grid_lines, split_at_creases};
pub use error::SurfaceError;
pub use fairing::{FairingReport, curvature_variation, fair};
pub use grid::HeightGrid;
pub use knots::{Break, JumpThresholds, Knots, Placement};
pub use parted::Lines;
pub use surface::{Made, Piece, Settings, SurfaceReport, fit_with, make};
