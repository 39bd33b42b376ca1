//! Machining features of a part that is seen from above: pockets, slots, steps, holes, bosses.
//!
//! Jun & Park, *Geometric feature recognition directly from scanned points using artificial
//! neural networks*: a scan is divided into regions of one feature each, the section curve of a
//! region is put in a code of a few digits, and a small network tells its class by that.

mod chance;
pub mod class;
pub mod code;
pub mod edges;
pub mod network;
pub mod patterns;
pub mod reduce;
