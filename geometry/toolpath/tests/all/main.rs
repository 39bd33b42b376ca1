//! All tests of tool paths.

#[path = "../bench/mod.rs"]
mod bench;

mod contact;
mod paths;
mod program;
