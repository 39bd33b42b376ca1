//! Machining features of a part that is seen from above: pockets, slots, steps, holes, bosses.
//!
//! Jun & Park, *Geometric feature recognition directly from scanned points using artificial
//! neural networks*: a scan is divided into regions of one feature each, the section curve of a
//! region is put in a code of a few digits, and a small network tells its class by that.

pub mod arrangement;
pub mod border;
pub mod candidate;
mod chance;
pub mod class;
pub mod code;
pub mod edges;
pub mod edit;
pub mod feature;
pub mod field;
pub mod floor;
pub mod frame;
pub mod levels;
pub mod measure;
pub mod network;
pub mod outline;
pub mod patterns;
pub mod plane;
pub mod ray;
pub mod rebuild;
pub mod recognise;
pub mod reduce;
pub mod regions;
pub mod section;
pub mod sight;
pub mod thread;
pub mod treatment;
