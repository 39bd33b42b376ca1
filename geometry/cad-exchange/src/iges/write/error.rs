//! Why a model cannot be written.

use std::io;

use nurbs::PiecewiseError;

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

/// What is wrong with a face.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FaceDefect {
    /// It has no name.
    #[error("its name is empty")]
    NoName,
    /// Counts do not match, breaks do not ascend, or a number is not finite.
    #[error("{place}: {source}")]
    Malformed {
        /// Surface or curve.
        place: String,
        /// In what way.
        source: PiecewiseError,
    },
    /// Finite coefficients give a coordinate beyond all numbers.
    #[error("{place} has a coordinate that is too large to be written")]
    Overflow {
        /// Patch of the surface.
        place: String,
    },
    /// Two pieces do not meet.
    #[error("pieces {piece} and {neighbour} of {place} are {gap_mm:e} mm apart")]
    Torn {
        /// Surface or curve.
        place: String,
        /// The first of the two pieces, counted from 0.
        piece: usize,
        /// The other one.
        neighbour: usize,
        /// How far they are apart.
        gap_mm: f64,
    },
    /// A loop without edges.
    #[error("{place} has no edges")]
    EmptyLoop {
        /// Which loop.
        place: String,
    },
    /// A coedge names an edge or vertex that the model lacks.
    #[error("{place} refers to an edge or vertex that the model does not have")]
    Dangling {
        /// Which coedge.
        place: String,
    },
    /// A loop that does not close.
    #[error("{place} ends {gap_mm:e} mm from where the next edge of its loop begins")]
    OpenLoop {
        /// Which curve of which coedge.
        place: String,
        /// Size of the gap; infinite where the vertices differ.
        gap_mm: f64,
    },
    /// A loop that runs the wrong way round.
    #[error("{place} must run {expected} in the parameter plane, but does not")]
    WrongSense {
        /// Which loop.
        place: String,
        /// How it should run.
        expected: &'static str,
    },
    /// A curve that is not on the surface.
    #[error("{place} lies {gap_mm:e} mm off the surface")]
    OffSurface {
        /// Which curve.
        place: String,
        /// How far.
        gap_mm: f64,
    },
    /// A parameter curve that leaves the surface's rectangle.
    #[error("{place} leaves the surface's parameter rectangle by {gap_mm:e} mm")]
    OutsideRectangle {
        /// Which curve.
        place: String,
        /// How far.
        gap_mm: f64,
    },
}
