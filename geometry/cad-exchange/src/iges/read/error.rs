//! Why a file cannot be read.

use std::io;

/// Why [`crate::iges::read_points`] or [`crate::iges::read_model`] gave nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The source failed.
    #[error("cannot read the IGES file: {0}")]
    Io(#[from] io::Error),
    /// More bytes than are read into memory.
    #[error("the IGES file is larger than {limit} bytes, the most that is read")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// Nothing but blanks.
    #[error("the IGES file is empty")]
    Empty,
    /// The standard's compressed or binary form.
    #[error(
        "the file is IGES in its {form} form, and only fixed 80-column ASCII is read: \
         export it again as ASCII"
    )]
    Form {
        /// `compressed` or `binary`.
        form: &'static str,
    },
    /// A line that is not one of an IGES file.
    #[error("line {line}: {reason}")]
    Line {
        /// Counted from 1; where lines have no ends, in records of 80 columns.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A section is missing.
    #[error("the IGES file has no {section} section: it is damaged or was cut off")]
    Section {
        /// Name of the section.
        section: &'static str,
    },
    /// A field of the Global section.
    #[error("Global section, field {field} ({name}): {reason}")]
    Global {
        /// Counted from 1, as in the standard.
        field: usize,
        /// What the field means.
        name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A field of a directory entry.
    #[error("line {line}, directory entry D{directory}: {name} is {value:?}, not a number")]
    Directory {
        /// Of the file, counted from 1.
        line: usize,
        /// Sequence number of the entry's first line.
        directory: usize,
        /// What the field means.
        name: &'static str,
        /// What stands there.
        value: String,
    },
    /// The parameters of an entity.
    #[error("line {line}, entity {entity} (D{directory}): {reason}")]
    Entity {
        /// Of the file, counted from 1.
        line: usize,
        /// Entity type number.
        entity: u32,
        /// Sequence number of its directory entry.
        directory: usize,
        /// What is wrong.
        reason: String,
    },
    /// A sound file without what was asked for.
    #[error("the IGES file holds no {wanted}, {found}")]
    Nothing {
        /// What was looked for.
        wanted: &'static str,
        /// Types of the entities that are there, and what that means.
        found: String,
    },
    /// More points than are read into memory.
    #[error("the IGES file holds more than {limit} points, the most that are read")]
    TooManyPoints {
        /// The limit.
        limit: usize,
    },
}
