//! What became of each gap.

use crate::odds::Evidence;

/// What was done about a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// Its nodes have got values and a region.
    Closed,
    /// It is as it was.
    Kept,
}

/// Why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Something higher stands between it and the sensor or the laser.
    Hidden,
    /// What came back, or how rays are lost around it, tells of a surface.
    Surface,
    /// So many rays are lost by chance.
    Chance,
    /// No ray went there.
    NoRay,
    /// Something came back from below the surface.
    Below,
    /// Nothing came back, where around it nearly everything does.
    NoReturn,
    /// It lies between surfaces that do not meet in it.
    Step,
    /// It is larger than what may be closed.
    Size,
    /// No surface could be carried on into it.
    NoSurface,
    /// The user said so.
    Asked,
}

impl Cause {
    /// A word for reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Hidden => "hidden",
            Self::Surface => "surface",
            Self::Chance => "chance",
            Self::NoRay => "no-ray",
            Self::Below => "below",
            Self::NoReturn => "no-return",
            Self::Step => "step",
            Self::Size => "size",
            Self::NoSurface => "no-surface",
            Self::Asked => "asked",
        }
    }
}

/// An enclosed place without a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Mean place of its nodes, millimetres; z of the surface that is carried on into it, or of what is
    /// around it.
    pub centre_mm: [f64; 3],
    /// Diameter of the largest circle that fits into it, millimetres.
    pub size_mm: f64,
    /// Its nodes.
    pub nodes: usize,
    /// The regions that it was given to, or that it lies in, ascending.
    pub regions: Vec<u16>,
    /// What was done.
    pub decision: Decision,
    /// Why.
    pub cause: Cause,
    /// What the rays tell; `None` where they were not asked.
    pub evidence: Option<Evidence>,
}
