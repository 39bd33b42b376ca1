//! `relief features train`.

mod args;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use run::run;
