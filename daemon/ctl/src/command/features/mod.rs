//! `relief features`.

mod train;

use crate::failure::Failure;

/// Machining features, and the networks that tell them
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    Train(train::Args),
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        Action::Train(args) => train::run(args, json).await,
    }
}
