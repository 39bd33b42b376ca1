//! What keeps a model from being written.

use nurbs::PiecewiseError;

/// What is wrong with a model; each writer has its own words for the model as a whole.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Defect {
    /// There is nothing to write.
    NoFaces,
    /// Two faces have one name.
    DuplicateName { name: String },
    /// A face breaks a promise of the model.
    Face { face: String, defect: FaceDefect },
}

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
