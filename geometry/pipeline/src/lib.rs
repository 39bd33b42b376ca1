//! The whole road from a range image to a model, stage by stage.
