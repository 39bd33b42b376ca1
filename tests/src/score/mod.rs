//! How near a label image comes to the truth, as pure functions on label images.
//!
//! A label image is a slice with one label a node; 0 is no label.

mod hoover;
mod overlaps;
mod rand_index;

pub use hoover::{Classes, MachineClass, TruthClass, classify};
pub use overlaps::Overlaps;
pub use rand_index::{Agreement, adjusted_rand_index};
