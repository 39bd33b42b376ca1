//! Regions of one surface each.
//!
//! Segmentation ends regions at creases and steps. Where surfaces join smoothly, as a fillet does
//! with its faces, it leaves them in one region; and it may cut a ring in two. Here regions are
//! taken apart into the planes, spheres, cylinders, cones and tori that they are made of, and
//! neighbours that are one of these are made one.
//!
//! ```text
//! regions, samples --> of one shape? --> of one swept profile, cut into lines and arcs?
//!     --> windows grown over their surface, the largest first
//!     --> nodes given to the piece that explains them best --> faces
//! ```
//!
//! What a window is of is decided by [`shapes::decide`], never by a distance; a region that is
//! not for the most part of shapes stays as it is.

mod blend;
mod compete;
mod divide;
mod field;
mod fillet;
mod grow;
mod join;
mod observations;
mod profile;
mod rounding;
mod search;
mod split;
mod strain;
#[cfg(test)]
mod testing;
mod unite;

pub use divide::{Divided, divide};
pub use observations::Observations;
