//! What can go wrong.

use range_image::Cancelled;

/// A mesh that cannot be filled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FillError {
    /// There is no triangle.
    #[error("it holds no triangle")]
    Empty,
    /// No triangle has an area.
    #[error("none of its {triangles} triangles has an area")]
    Degenerate {
        /// How many there are.
        triangles: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the vertex, from 1.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, and there are {vertices}")]
    NoVertex {
        /// Index of the triangle, from 1.
        triangle: usize,
        /// The vertex that it names, from 1.
        vertex: usize,
        /// Vertices that there are.
        vertices: usize,
    },
    /// A number of a loop that there is not.
    #[error("there is no loop {number}; there are {loops}")]
    NoLoop {
        /// The number that was given.
        number: usize,
        /// Loops that there are.
        loops: usize,
    },
    /// A setting out of its range.
    #[error("{name} {value}: must be {expected}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// The caller has lost interest.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
