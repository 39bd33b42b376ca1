//! Faces, and the edges that they share.

use crate::{Curve, Point, Surface};

/// What faces are made of. Indices are those of the lists here.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Body {
    /// Ends of edges, millimetres.
    pub vertices_mm: Vec<Point>,
    /// Each once, however many faces it bounds.
    pub edges: Vec<Edge>,
    /// The faces.
    pub faces: Vec<Face>,
}

/// A curve from one vertex to another, or round to the same one.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// Where it begins and ends.
    pub vertices: [usize; 2],
    /// What it runs along.
    pub curve: Curve,
    /// It runs as the curve's parameter grows, not against it.
    pub same_sense: bool,
}

/// An edge in a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeUse {
    /// The edge.
    pub edge: usize,
    /// The loop runs from its end to its start.
    pub is_reversed: bool,
}

/// A trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// As whoever made it calls it, for messages.
    pub name: String,
    /// What it is a part of.
    pub surface: Surface,
    /// Its outside is where the surface's normal points.
    pub same_sense: bool,
    /// It lies to the left of them, seen from outside. Where there are none it is the whole
    /// surface.
    pub loops: Vec<Vec<EdgeUse>>,
}

/// Why there are no triangles of a body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// An index beyond its list.
    #[error("{what} {index} is used, but there is none")]
    Missing {
        /// Vertex or edge.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// An edge is not where its vertices or faces are.
    #[error(
        "{face}: an edge leaves the surface by {off_mm:.4} mm near ({:.3}, {:.3}, {:.3}) mm",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    OffSurface {
        /// Name of the face.
        face: String,
        /// How far.
        off_mm: f64,
        /// Where.
        at_mm: [f64; 3],
    },
    /// Loops that cross, or do not go around anything.
    #[error("{face}: {reason}")]
    Loops {
        /// Name of the face.
        face: String,
        /// What is wrong with them.
        reason: &'static str,
    },
    /// Triangles do not come as near to a surface as they should.
    #[error("{face}: its surface bends too sharply for triangles within {tolerance_mm} mm of it")]
    Bends {
        /// Name of the face.
        face: String,
        /// What was asked for.
        tolerance_mm: f64,
    },
    /// More than are wanted.
    #[error("more than {most} triangles: ask for a greater tolerance")]
    TooMany {
        /// How many are.
        most: usize,
    },
}
