//! The whole road from a range image to a model, stage by stage.

mod observer;

pub use observer::{Observer, Stage};
