//! `relief fill`.

mod args;
mod read;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use run::run;
