//! `relief config`.

mod check;

use crate::failure::Failure;

/// Look at the configuration of the service
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: ConfigCommand,
}

#[derive(Debug, clap::Subcommand)]
enum ConfigCommand {
    Check(check::Args),
}

pub(crate) fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.command {
        ConfigCommand::Check(args) => check::run(&args, json),
    }
}
