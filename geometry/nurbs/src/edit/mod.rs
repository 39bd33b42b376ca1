//! Curves and surfaces written another way, or with fewer numbers: knots inserted and removed, the
//! degree raised, taken apart into Bezier pieces.

mod curve;
mod elevate;
mod polygon;
mod refine;
mod remove;
mod surface;

pub use remove::Removal;
