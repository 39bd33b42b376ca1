//! All tests of regridding.

mod common;
mod estimator;
mod masks;
mod order;
mod settings;
mod stretched;
