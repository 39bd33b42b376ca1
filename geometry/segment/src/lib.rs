//! Range images to regions of one surface each.
//!
//! A region ends at creases and steps, and nowhere else: surfaces that join smoothly are one.
//! A *crease* is a change of direction across a border, a *step* a jump of z. The noise is
//! measured in the image itself and scales every decision.
//!
//! # `relief`, the default
//! 1. Planes, quadrics and quartics grow from the flattest windows, the widest first (Besl &
//!    Jain 1988, *Segmentation through variable-order surface fitting*). Nodes join by their
//!    distance and by a direction from windows that keep to one side of edges (Nagao &
//!    Matsuyama 1979, *Edge preserving smoothing*).
//! 2. Pieces that a neighbour explains are given up; nodes that nothing explains become pieces
//!    of their own, so that faces too narrow for any window are found; strips of a node or two
//!    also across the steps that seem to lie between their nodes.
//! 3. Pieces compete for the nodes at their borders.
//! 4. Two planes are one face when one surface explains both. Other neighbours become one
//!    region where what a crease and a step would add to a fit across their border is small,
//!    through windows of several sizes; curved ones also where their own surfaces go on in each
//!    other. What a plane ends in is a step where most of that border is one.
//!
//! # `shim-lee`, the baseline
//! Section II.2 of Shim & Lee 1995, *Conversion of the range data into the CAD format*: a unit
//! normal at each node from a plane through the 5 x 5 nodes around ([`normals`]); six features
//! (x, y, z and the normal) of like variance; squared-error clustering; connected components
//! within clusters; neighbours whose common border is neither crease nor step become one.
//!
//! # Limits
//! With the default settings, noise of an eighth of the pitch and regions of at least 100
//! nodes: creases from 10 degrees and steps from 1 mm part planes, and faces from about four
//! nodes wide are kept; narrower ones may come out in parts, or be lost among outliers. Creases below half of that are
//! smooth passages. Roundings of a few nodes in radius count as creases, since regridding rounds
//! creases as much. Where curved faces meet, a border that noise leaves undecided is taken for
//! smooth, so that one face may run into another; free forms with many folds come out in
//! more regions than a person would draw. Where depths are coarse, faces that the camera sees
//! squarely are rough, and a terrace of them may be left as a region of its own. Parts of a
//! face that others cut off from each other are regions of their own.

mod background;
mod components;
mod fill;
mod grid;
mod local_fit;
mod merge;
mod noise;
mod normals;
mod relief;
mod scene;
mod segmentation;
mod settings;
mod shim_lee;

pub use background::{Background, BackgroundKind, BackgroundRegion, Plane, View, background};
pub use normals::{Normals, Window, normals};
pub use segmentation::{
    MAX_Z_MM, Report, SegmentError, Segmentation, segment, segment_with_report,
};
pub use settings::{Method, SegmentSettings, SettingsError};
