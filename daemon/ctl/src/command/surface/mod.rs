//! `relief surface`.

mod args;
mod pictures;
mod run;
mod summary;
mod write;

pub(crate) use args::Args;
pub(crate) use run::run;
