//! One closed solid of a block with outlines cut into it and raised on it.
//!
//! A [`Part`] is seen along -z of its frame: a block, and [`Operation`]s that lower or raise what
//! is within an [`Outline`], one after the other. The outlines divide the plan into cells; each
//! cell has one surface after all operations. Cells that share a surface are one face, different
//! heights on both sides of an edge make a wall, and all share their edges and vertices
//! ([`Part::build`]).

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
