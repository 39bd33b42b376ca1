//! Range images to regions of one surface each: section II.2 of Shim & Lee 1995, *Conversion
//! of the range data into the CAD format*.
//!
//! 1. A unit normal at each node from a plane through the 5 x 5 nodes around ([`normals`]).
//! 2. Six features (x, y, z and the normal) of like variance; squared-error clustering.
//! 3. Connected components within clusters; slivers go to the neighbour that explains them.
//! 4. Neighbours whose common border is neither crease nor step become one region.
//!
//! A *crease* is a change of direction across a border, a *step* a jump of z. Both are
//! measured between the two surfaces, each fitted a little inside its own region and carried
//! on to the border, since what lies on the border itself mixes both sides.
//!
//! # Limits
//! With the default settings, noise of an eighth of the pitch and creases of 15 degrees or
//! more, borders lie within 1.5 nodes of the true ones; creases below 10 degrees are smooth
//! passages. Faces narrower than about five nodes cannot be told from the mixture of their
//! neighbours and are given to these. Steps below about two pitches may be bridged where
//! noise hides them.

mod background;
mod cluster;
mod components;
mod crease;
mod features;
mod fill;
mod grid;
mod local_fit;
mod merge;
mod noise;
mod normals;
mod regrow;
mod scene;
mod segmentation;
mod settings;

pub use background::{Background, BackgroundKind, BackgroundRegion, Plane, View, background};
pub use normals::{Normals, Window, normals};
pub use segmentation::{
    MAX_Z_MM, Report, SegmentError, Segmentation, segment, segment_with_report,
};
pub use settings::{Method, SegmentSettings, SettingsError};
