//! `relief accept`.

mod args;
mod judge;
mod measure;
mod reference;
mod run;
mod summary;

pub(crate) use args::Args;
pub(crate) use run::run;
