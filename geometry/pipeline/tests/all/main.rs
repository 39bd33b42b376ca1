//! All tests of the way from samples to surfaces.

mod outlines;
mod regular;
mod road;
mod swept;
mod tangent;
mod threads;
