//! `relief toolpath`.

mod args;
mod model;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use run::run;
