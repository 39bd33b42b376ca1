//! Why a file cannot be read.

use std::io;

/// Why [`crate::step::read_model`] gave nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The source failed.
    #[error("cannot read the STEP file: {0}")]
    Io(#[from] io::Error),
    /// More bytes than are read into memory.
    #[error("the STEP file is larger than {limit} bytes, the most that is read")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// Another kind of file.
    #[error(
        "the file does not begin with ISO-10303-21, so it is no STEP file in clear text: \
         export it again as STEP (.step, .stp)"
    )]
    Form,
    /// Text that is not of the form that the standard asks for.
    #[error("line {line}, column {column}: {reason}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// In bytes, counted from 1.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
    /// An instance that does not hold what it should, or is not of a kind that is read.
    #[error("line {line}, {entity} (#{id}): {reason}")]
    Instance {
        /// Of the file, counted from 1.
        line: usize,
        /// Keyword of the entity.
        entity: String,
        /// Number of the instance.
        id: u64,
        /// What is wrong.
        reason: String,
    },
    /// A record of the header.
    #[error("header, {record}: {reason}")]
    Header {
        /// Keyword of the record.
        record: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A sound file without what was asked for.
    #[error(
        "the STEP file holds no {wanted}, {found}; only files that Relief wrote are read as \
         models"
    )]
    Nothing {
        /// What was looked for.
        wanted: &'static str,
        /// Entities that are there.
        found: String,
    },
}
