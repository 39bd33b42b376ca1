//! All tests of hole filling.

#[path = "../common/mod.rs"]
mod common;

mod bunny;
mod holes;
mod random;
