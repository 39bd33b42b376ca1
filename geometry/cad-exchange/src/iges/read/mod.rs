//! The reader, in layers: bytes to lines to sections ([`lines`]), the Global section
//! ([`global`]), directory entries and parameter records ([`mod@file`] on [`values`]), and on
//! top of these what is wanted: points ([`points`]), trimmed faces ([`model`]) or those of shells
//! ([`shell`]).
//!
//! Files come from anywhere: nothing is allocated by a count before the values are there.

mod analytic;
mod error;
mod file;
mod global;
mod lines;
mod model;
mod plain;
mod points;
mod shell;
mod transform;
mod values;

pub use analytic::{AnalyticSurface, SurfaceFrame};
pub use error::ReadError;
pub use lines::MAX_FILE_BYTES;
pub use model::{SplineCurve, TrimmedCurve, TrimmedFace, TrimmedModel, TrimmedSurface, read_model};
pub use plain::{Chain, PlainSurface, read_chains, read_surfaces};
pub use points::read_points;
pub use shell::Shell;
