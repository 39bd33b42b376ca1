//! From regions of a range image to a model of trimmed faces that share their edges.

pub mod model;

pub use model::{Coedge, Edge, EdgeId, EdgeKind, Face, Loop, Model, Surface, Vertex, VertexId};
