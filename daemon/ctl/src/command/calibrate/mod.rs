//! `relief calibrate`.

mod args;
mod reference;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use reference::{check_diameter, heights_mm, toml_of};
pub(crate) use run::run;
