//! The model: trimmed faces, their loops, and the edges and vertices they share.
//!
//! A scan sees a part from one side, so every face is the graph of a function over the
//! x-y plane, and two faces that are neighbours in the image share the path of their
//! border in that plane. The path is the [`Edge`]; each face lifts it onto its own
//! surface, and the two lifted curves of a crease meet as well as the surfaces do.

use nurbs::{PatchSurface, PiecewiseCubic};
use shapes::Form;

/// Index into [`Model::vertices`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub usize);

/// Index into [`Model::edges`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EdgeId(pub usize);

/// Trimmed faces with shared edges and vertices. Millimetres, part frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Where edges end.
    pub vertices: Vec<Vertex>,
    /// Borders, each listed once however many faces it bounds.
    pub edges: Vec<Edge>,
    /// The trimmed surfaces, in the order of their regions.
    pub faces: Vec<Face>,
}

/// An end of edges: a place in the x-y plane; its z is that of the face looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Along the slide table.
    pub x_mm: f64,
    /// Up.
    pub y_mm: f64,
}

/// A border between two regions, or between a region and nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// Where the path begins.
    pub start: VertexId,
    /// Where the path ends; equal to `start` for a border without a vertex of its own.
    pub end: VertexId,
    /// What the border is.
    pub kind: EdgeKind,
    /// How it is known where it runs.
    pub origin: EdgeOrigin,
    /// The path in the x-y plane, from `start` to `end`; one or more cubic pieces with
    /// arc length as parameter (Shim & Lee 1995, equation 7), to a few per cent where they
    /// are curved.
    pub path: PiecewiseCubic<2>,
}

/// What separates the two sides of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeKind {
    /// Nothing was measured on the other side.
    Silhouette,
    /// z jumps.
    Step,
    /// The surface is continuous, its normal is not.
    Crease,
}

/// How it is known where an edge runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EdgeOrigin {
    /// The samples beside it tell.
    Measured,
    /// The surfaces on its two sides intersect there, or touch.
    Intersected,
    /// It is drawn between the nodes of its two sides, and nothing tells more.
    Assumed,
}

/// A trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Unique in the model, fit for a CAD program's tree.
    pub name: String,
    /// Label of the region it came from.
    pub region: u16,
    /// The untrimmed surface; its normal points towards the camera (+z).
    pub surface: Surface,
    /// What the surface is, where it is of a kind that engineers know: the patches
    /// are this form to [`FORM_TOLERANCE_MM`]. `None` for a free form.
    pub form: Option<Form>,
    /// Counter-clockwise in the parameter plane.
    pub outer: Loop,
    /// Holes, clockwise in the parameter plane.
    pub inner: Vec<Loop>,
}

/// The carrier of a face.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// Bicubic patches over x and y.
    Patches(PatchSurface),
}

/// A closed chain of edges: each ends where the next begins, the last where the first does.
#[derive(Debug, Clone, PartialEq)]
pub struct Loop {
    /// In the sense of travel.
    pub coedges: Vec<Coedge>,
}

/// The use of an edge by a loop of a face.
#[derive(Debug, Clone, PartialEq)]
pub struct Coedge {
    /// The edge used.
    pub edge: EdgeId,
    /// True where the loop runs from the edge's end to its start.
    pub reversed: bool,
    /// The edge in the surface's parameter plane, in the loop's sense of travel.
    pub parameter_curve: PiecewiseCubic<2>,
    /// The edge on the surface in space, in the loop's sense of travel; on the surface
    /// to [`crate::model::SPACE_CURVE_TOLERANCE_MM`], with ends equal to those of its
    /// neighbours in the loop.
    pub space_curve: PiecewiseCubic<3>,
}

/// How far a coedge's space curve may lie off its surface, millimetres.
pub const SPACE_CURVE_TOLERANCE_MM: f64 = 1e-4;

/// How far the patches of a face lie off its form at the nodes of its region, root mean square
/// along the normal, millimetres.
pub const FORM_TOLERANCE_MM: f64 = 5e-3;
