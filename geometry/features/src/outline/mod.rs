//! Outlines in the plan, told by the samples on both sides of them.

mod hearing;
mod posterior;
mod shape;
mod start;
pub mod witnesses;

pub use posterior::{Outline, Witness, log_likelihood, outline};
pub use shape::{Circle, Rectangle, Shape};
pub use start::{circle, rectangle};
