//! One closed solid of a block with outlines cut into it and raised on it.
//!
//! A [`Part`] is seen along -z of its frame: a block, and [`Operation`]s that lower or raise what
//! is within an [`Outline`], one after the other. The outlines divide the plan into cells; each
//! cell has one surface after all operations. Cells that share a surface are one face, different
//! heights on both sides of an edge make a wall, and all share their edges and vertices
//! ([`Part::build`]).
//!
//! The solid is always closed and in one piece, or there is an error that names the operation. What
//! had to be done otherwise than asked for is told as a [`Warning`]: a treated edge left as it is
//! (it meets several surfaces, or walls that are too low, or a line and an arc at an angle), an
//! outline moved by some hundredths of a millimetre where the solid would have touched itself, a
//! step where two floors cross and the crossing could not be followed, the largest of several parts
//! kept. Lines of outlines and levels within [`Part::snap_mm`] of earlier ones become those; so do
//! whole circles; arcs follow the lines that they touch.

mod arrange;
mod bands;
mod build;
mod contour;
mod emit;
mod error;
mod field;
mod height;
mod outline;
mod part;
mod plan;
mod regions;
mod shell;
mod solid;
mod trace;
mod treat;
mod union;

pub use build::Built;
pub use error::{BuildError, OutlineError, Warning};
pub use outline::{LEAST_MM, Outline};
pub use part::{Floor, Frame, Kind, Operation, Part, Treatment};
pub use plan::Piece;
pub use solid::{
    EdgeUse, Placement, Role, Solid, SolidCurve, SolidEdge, SolidFace, SolidSurface, Unsound,
};
