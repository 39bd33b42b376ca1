//! Why there is no surface.

use range_image::Cancelled;

/// Why no surface was made, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// The pitch is no length.
    #[error("a pitch of {pitch_mm} mm is no distance between nodes")]
    Pitch {
        /// The pitch.
        pitch_mm: f64,
    },
    /// Fewer nodes along a side than a cubic needs.
    #[error(
        "{columns} x {rows} grid nodes are too few for a cubic surface, which needs 4 x 4; \
         choose a smaller pitch"
    )]
    TooFewNodes {
        /// Nodes along x.
        columns: usize,
        /// Nodes along y.
        rows: usize,
    },
    /// Values and nodes do not match.
    #[error("the grid needs {needed} values, but there are {given}")]
    Count {
        /// Nodes.
        needed: usize,
        /// Values.
        given: usize,
    },
    /// A value is infinite.
    #[error("z at column {column}, row {row} is infinite")]
    Infinite {
        /// Column of the node.
        column: usize,
        /// Its row.
        row: usize,
    },
    /// No node has a value.
    #[error("no grid node has a value")]
    AllMasked,
    /// A length in the settings is out of range.
    #[error("{what} is {value_mm} mm; it must be above 0 and at most 1000")]
    Setting {
        /// Which.
        what: &'static str,
        /// Its value.
        value_mm: f64,
    },
    /// A threshold of the derivative test is out of range.
    #[error("the threshold of derivative {order} is {value}; it must be above 0")]
    Threshold {
        /// Order of the derivative.
        order: usize,
        /// The threshold.
        value: f64,
    },
    /// Not even knots at every node bring the surface within the tolerance.
    #[error(
        "a tolerance of {tolerance_mm} mm cannot be reached: with knots at every node the \
         farthest one is still {best_mm:.2e} mm off; ask for more than that"
    )]
    OutOfReach {
        /// What was asked for.
        tolerance_mm: f64,
        /// Greatest deviation of the best surface.
        best_mm: f64,
    },
    /// The normal equations have no single solution.
    #[error("the data do not determine the surface; choose fewer knots or a smaller pitch")]
    Singular,
    /// Given up at the caller's wish.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
