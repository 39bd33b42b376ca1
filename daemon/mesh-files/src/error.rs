//! What can go wrong.

use std::io;

/// A file could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The destination failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The points could not be read again.
    #[error("the points cannot be read: {0}")]
    Points(io::Error),
    /// The mesh cannot stand in a file of this format.
    #[error("cannot be written as {format}: {reason}")]
    Format {
        /// Name of the format.
        format: &'static str,
        /// Why not.
        reason: String,
    },
}

impl MeshFileError {
    /// What the destination said, where that was the trouble.
    #[must_use]
    pub fn io(&self) -> Option<&io::Error> {
        match self {
            Self::Io(error) => Some(error),
            _ => None,
        }
    }
}
