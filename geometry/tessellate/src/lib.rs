//! Trimmed faces to triangles, within a stated distance of the model's surfaces.
//!
//! ```text
//! edges --> Division (each once) --> outlines of faces --> triangles between their points
//!       --> points where the surface bends --> Mesh, in which neighbours share their seams
//! ```
//!
//! Every face is the graph of a function over the x-y plane, and its border a polygon there, so
//! that triangles are sought in the plane: whatever turns counter-clockwise there faces the
//! camera. Their shape is judged in space. An edge is divided once, for all faces that it bounds;
//! along a crease these have one height as far as their surfaces meet, and share its points.

mod divide;
mod error;
mod face;
mod mesh;
mod net;
mod outline;
mod refine;
mod run;
mod settings;
mod sew;
mod vector;

pub use error::TessellateError;
pub use mesh::{Accuracy, Corner, Mesh, MeshFace};
pub use run::tessellate;
pub use settings::{SettingsError, TessellateSettings};
