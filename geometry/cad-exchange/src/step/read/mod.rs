//! The reader, in layers: bytes to values ([`syntax`]), strings ([`text`]), instances and
//! their values by what they mean ([`exchange`]), and the model on top ([`model`],
//! [`shapes`], [`properties`]).
//!
//! Files come from anywhere: nothing is allocated by a count before the values are there,
//! lists are followed to a bounded depth, and no instance is converted twice.

mod error;
mod exchange;
mod known;
mod model;
mod properties;
mod shapes;
mod solids;
mod syntax;
mod text;

pub use self::solids::read_body;
pub use error::ReadError;
pub use model::{StepEdge, StepEdgeUse, StepFace, StepFrame, StepModel, StepSurface, read_model};

/// Largest file that is read, bytes; it is held in memory as a whole, its values in up to
/// thirty times as much.
pub const MAX_FILE_BYTES: u64 = 1 << 25;
