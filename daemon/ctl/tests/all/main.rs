//! All tests of the `relief` program.

mod bad_input;
#[path = "../../../../geometry/compare/tests/bench/mod.rs"]
mod bench;
mod common;
mod compare;
mod features;
mod features_train;
mod fill;
mod holes;
mod metrology;
mod pages;
mod program;
mod schema;
mod skin;
mod surface;
mod toolpath;
