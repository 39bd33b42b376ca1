//! From regions of a range image to a model of trimmed faces that share their edges.
//!
//! The road of Shim & Lee 1995, sections III to V: borders are traced between the nodes
//! of different regions ([`erosion`] has the paper's own detector), drawn as smooth
//! paths between vertices, and lifted onto a surface of bicubic patches fitted to each
//! region ([`extension`], [`fit`]). The planar map of borders comes first, so that two
//! faces that meet share one path, and no two paths cross.

pub mod check;
pub mod comparison;
pub mod erosion;
pub mod extension;
pub mod fit;
pub mod metrics;
pub mod model;
pub mod polygon;
pub mod settings;

mod accept;
mod account;
mod assemble;
mod border;
mod evidence;
mod known;
mod lift;
mod meeting;
mod noise;
mod origins;
mod pieces;
mod refine;
mod run;
#[cfg(test)]
mod testing;
mod trim;

pub use evidence::{Evidence, Known, OutlineSample, Seen};
pub use metrics::Metrics;
pub use model::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};
pub use run::{Fitted, Reconstruction, RegionFit, reconstruct};
pub use settings::{Method, ReconstructError, ReconstructSettings, SettingsError};
