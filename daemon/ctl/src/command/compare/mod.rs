//! `relief compare`.

mod args;
pub(crate) mod nominal;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use run::run;
