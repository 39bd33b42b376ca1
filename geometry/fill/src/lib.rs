//! Holes of triangle meshes closed.
//!
//! ```text
//! triangles --> welded, mended --> loops --> holes, islands, the borders of open sheets
//!   each hole: what is around it --> implicit surface --> elements on its zero set, joined to the mesh
//! ```
//!
//! After Yoo, "A study on filling holes of the polygon model using implicit surface scheme" (Journal of
//! the Korean Society for Precision Engineering 22, 2005): a function of space is put through the points
//! around a hole, and its zero set closes it. [`Method::Yoo`] goes the paper's way to the end, by a
//! base surface of Ferguson patches and a trimmed part of it. [`Method::Relief`] puts elements onto the
//! zero set itself, so that a hole may have any shape, and takes only as much of the mesh as matters.
//!
//! Triangles that are there stay where they are, to the last bit.

mod close;
mod error;
mod holes;
pub mod implicit;
mod loops;
mod meet;
mod mesh;
mod patch;
mod region;
mod report;
mod run;
mod settings;
mod yoo;

pub use error::FillError;
pub use holes::{Hole, HoleKind};
pub use implicit::{FitSettings, Implicit, ImplicitError, Kernel, Sample, Smoothing, Solver};
pub use mesh::{Mended, TriangleMesh};
pub use report::{Filled, HoleReport, Outcome, Survey};
pub use run::{fill, survey};
pub use settings::{Method, Precision, Settings};
pub use yoo::TrimmedPatch;
