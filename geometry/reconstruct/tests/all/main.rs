//! All tests of reconstruction.

mod closed_forms;
mod common;
mod curved_corners;
mod degenerate;
mod given_surfaces;
mod random_maps;
