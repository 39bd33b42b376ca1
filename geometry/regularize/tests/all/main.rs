//! All tests of regularities.

mod common;
mod exact;
mod monte_carlo;
mod tangent;
