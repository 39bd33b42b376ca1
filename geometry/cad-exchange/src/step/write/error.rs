//! Why a model cannot be written.

use std::io;

use crate::common::{Defect, FaceDefect};

/// Why [`crate::step::write()`] wrote nothing, or not everything.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The destination failed.
    #[error("cannot write the STEP file: {0}")]
    Io(#[from] io::Error),
    /// A value of [`crate::step::WriteOptions`] cannot stand in a file.
    #[error("STEP option {option} is {value:?}: expected {expected}")]
    Option {
        /// The field of the options.
        option: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// There is nothing to write.
    #[error("the model has no faces, so there is nothing to write to a STEP file")]
    NoFaces,
    /// Two faces have one name.
    #[error("two faces are named {name:?}: every face needs a name of its own")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A solid is not closed.
    #[error("the solid cannot be written: {0}")]
    Solid(terraces::Unsound),
    /// A face breaks a promise of the model.
    #[error("face {face:?} cannot be written: {defect}")]
    Face {
        /// Name of the face.
        face: String,
        /// What is wrong with it.
        defect: FaceDefect,
    },
}

impl From<Defect> for WriteError {
    fn from(defect: Defect) -> Self {
        match defect {
            Defect::NoFaces => Self::NoFaces,
            Defect::DuplicateName { name } => Self::DuplicateName { name },
            Defect::Face { face, defect } => Self::Face { face, defect },
        }
    }
}
