//! `relief convert`.

mod args;
mod run;

pub(crate) use args::{Args, input_stem, same_file};
pub(crate) use run::run;
