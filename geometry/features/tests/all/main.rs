//! All tests of the recognition of machining features.

mod bowed;
mod code;
mod common;
mod edges;
mod edges_and_holes;
mod edits;
mod floors;
mod network;
mod recognise;
