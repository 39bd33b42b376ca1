//! STEP: clear text encoding (ISO 10303-21) of application protocols 242 and 214.
//!
//! [`write()`] turns a [`reconstruct::Model`] into shells of trimmed faces that share
//! their edges and vertices; [`read_model`] reads back what [`write()`] writes, and [`read_body`] the
//! faces of solids and shells that any program wrote.
//!
//! A scan sees a part from one side, so its faces never close: they become open shells
//! (`SHELL_BASED_SURFACE_MODEL`, ISO 10303-42, 6.4.26). What was rebuilt from its features is closed:
//! [`write_solid`] writes that.

mod read;
mod write;

pub use read::{
    MAX_FILE_BYTES, ReadError, StepEdge, StepEdgeUse, StepFace, StepFrame, StepModel, StepSurface,
    read_body, read_model,
};
pub use write::{
    DEFAULT_PALETTE, FaceDefect, LengthUnit, Schema, SolidSummary, Summary, WriteError,
    WriteOptions, write, write_solid,
};
