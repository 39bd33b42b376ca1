//! Where the knots of a surface go: the three placements of Koo & Lee (section 5, Figure 5).
//!
//! Ours is in [`crate::optimal`].

pub mod derivative;
pub mod polyline;
pub mod section;
pub mod uniform;

pub use derivative::{Break, JumpThresholds, breaks_of};
pub use polyline::simplified;
pub use section::{Section, longest_sections};

use crate::axis::Breaks;

/// How knots are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// Equal spans, doubled until the tolerance holds (Figure 4).
    Uniform,
    /// At the vertices of the reference sections' polylines (Figure 5, 2).
    Polyline,
    /// Where derivatives of the reference sections break (section 4.2; Figure 5, 3).
    Derivative,
    /// By the deviations over the whole grid, as few as the tolerance allows: ours.
    #[default]
    Optimal,
}

impl Placement {
    /// All of them, the paper's first.
    pub const ALL: [Self; 4] = [
        Self::Uniform,
        Self::Polyline,
        Self::Derivative,
        Self::Optimal,
    ];

    /// The word for it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Polyline => "polyline",
            Self::Derivative => "derivative",
            Self::Optimal => "optimal",
        }
    }
}

/// Inner knots along x and y, in nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Along x.
    pub u: Breaks,
    /// Along y.
    pub v: Breaks,
}

impl Knots {
    /// Number of control points.
    #[must_use]
    pub fn control_points(&self) -> usize {
        self.u.control_count() * self.v.control_count()
    }
}
