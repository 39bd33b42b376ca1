//! `relief features`.

mod args;
mod edits;
mod run;
mod summary;
mod train;

use crate::failure::Failure;

pub(crate) use args::Args;

/// Recognises features, or trains a network that does.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        Some(args::Action::Train(args)) => train::run(args, json).await,
        None => run::run(args, json).await,
    }
}
