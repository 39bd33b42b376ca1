//! What was found and what became of it.

use std::collections::BTreeSet;

use crate::holes::Hole;
use crate::implicit::Kernel;
use crate::mesh::{Mended, TriangleMesh};
use crate::yoo::TrimmedPatch;

/// What a mesh is, before anything is closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// What was mended.
    pub mended: Mended,
    /// Loops of border edges.
    pub holes: Vec<Hole>,
}

/// What became of a loop.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Closed.
    Filled {
        /// Radial function of the surface; `None` where the elements are only fair.
        kernel: Option<Kernel>,
        /// Points of the mesh that the surface was put through.
        points: usize,
        /// Radial functions in it.
        centres: usize,
        /// What the points lie off the surface, root mean square, millimetres.
        noise_mm: f64,
        /// New vertices.
        vertices: usize,
        /// New triangles.
        triangles: usize,
    },
    /// Left open since its number was named.
    Kept,
    /// Left open since it is the border of an open sheet.
    Border,
    /// Closed, or left open, with the hole around it.
    Island {
        /// The number of that hole.
        hole: usize,
    },
    /// Left open since it cannot be closed.
    Open {
        /// Why.
        reason: String,
    },
}

/// A loop and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct HoleReport {
    /// The loop.
    pub hole: Hole,
    /// What became of it.
    pub outcome: Outcome,
    /// The hole as a trimmed surface, or as several where no direction sees it whole, where that was asked
    /// for; or why it has none.
    pub patch: Option<Result<Vec<TrimmedPatch>, String>>,
}

/// A mesh with its holes closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Filled {
    /// The triangles that were there first, in their order, then the new ones.
    pub mesh: TriangleMesh,
    /// How many were there.
    pub old_triangles: usize,
    /// What was mended.
    pub mended: Mended,
    /// What became of every loop. Their vertices are numbered as [`survey`][crate::survey] has them; where
    /// triangles were [cleared][Mended::cleared] later ones have other numbers now.
    pub holes: Vec<HoleReport>,
}

impl Filled {
    /// Numbers of holes that could not be closed.
    #[must_use]
    pub fn open(&self) -> BTreeSet<usize> {
        let is_open = |own: &&HoleReport| matches!(own.outcome, Outcome::Open { .. });
        self.holes
            .iter()
            .filter(is_open)
            .map(|own| own.hole.number)
            .collect()
    }
}
