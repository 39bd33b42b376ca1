//! Surfaces by local consensus: what most of the evidence near a node speaks for.
//!
//! The median needs more than half of a window to lie on one surface, and at many outliers,
//! or next to a step edge, no surface has that much. Here planes through three samples are
//! rated by a bounded score instead (MSAC, Torr & Zisserman 2000): a sample counts the more
//! the nearer it lies to the plane, as measured by the scan's own noise, and the nearer to
//! the node; samples beyond a few standard deviations count nothing, however many. Where
//! samples that the best surface leaves over agree among themselves on another one, the
//! places of both surfaces' samples tell on whose side of the edge the node lies.

mod agreement;
mod arc;
mod at_issue;
mod bend;
mod logistic;
mod missing;
mod node;
mod noise;
mod posterior;
mod side;
mod silhouette;
mod surfaces;
mod votes;
mod wedge;

pub(crate) use missing::Around;
pub(crate) use node::{Conditions, Consensus};
pub(crate) use noise::{Noise, noise};
pub(crate) use silhouette::{Side, Silhouette};
pub(crate) use surfaces::{Effort, Surface, WIDTH};
