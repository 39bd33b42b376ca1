//! Why a model cannot be written.

use std::io;

use crate::common::{Defect, FaceDefect};

/// Why [`crate::iges::write()`] wrote nothing, or not everything.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The destination failed.
    #[error("cannot write the IGES file: {0}")]
    Io(#[from] io::Error),
    /// A value of [`crate::iges::WriteOptions`] cannot stand in a file.
    #[error("IGES option {option} is {value:?}: expected {expected}")]
    Option {
        /// The field of the options.
        option: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// There is nothing to write.
    #[error("the model has no faces, so there is nothing to write to an IGES file")]
    NoFaces,
    /// Two faces have one name.
    #[error("two faces are named {name:?}: every face needs a name of its own")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A face breaks a promise of the model.
    #[error("face {face:?} cannot be written: {defect}")]
    Face {
        /// Name of the face.
        face: String,
        /// What is wrong with it.
        defect: FaceDefect,
    },
    /// More lines than seven digits can number.
    #[error("the IGES file would need more than {MAX_LINES} lines in one section")]
    TooLarge,
}

/// The most lines that the sequence number in columns 74 to 80 can count.
pub(super) const MAX_LINES: usize = 9_999_999;

impl From<Defect> for WriteError {
    fn from(defect: Defect) -> Self {
        match defect {
            Defect::NoFaces => Self::NoFaces,
            Defect::DuplicateName { name } => Self::DuplicateName { name },
            Defect::Face { face, defect } => Self::Face { face, defect },
        }
    }
}
