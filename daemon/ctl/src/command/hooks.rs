//! `relief hooks`.

use relief_api::{HookList, HookRuns, path};

use super::runs;
use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Show the hooks, what became of their runs, and test them
///
/// A hook is a section [[hooks]] of the service's configuration: a program on its machine that is
/// run for each result. Without a further word, all of them are listed with what was last tried.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Show the results that a hook is still to be run for, and the latest runs, with every attempt
    Log {
        /// The hook
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
    /// Run a hook for the newest result, for 25 s at most, and show what comes of it
    Test {
        /// The hook
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        None => args.endpoint.show(path::HOOKS, json, list).await,
        Some(Action::Log { name, endpoint }) => {
            let log = |list: &HookRuns| runs::log(&list.runs, "nothing was run yet");
            endpoint.show(&path::hook_runs(&name), json, log).await
        }
        Some(Action::Test { name, endpoint }) => {
            runs::test(&path::hook_test(&name), &name, &endpoint, json).await
        }
    }
}

fn list(list: &HookList) -> String {
    if list.hooks.is_empty() {
        return "there are no hooks: each is a section [[hooks]] of the configuration".into();
    }
    let lines = list.hooks.iter().map(|hook| {
        vec![
            hook.name.clone(),
            hook.command.join(" "),
            hook.waiting.to_string(),
            runs::latest(hook.latest.as_ref(), "not run yet"),
        ]
    });
    output::table(&["HOOK", "COMMAND", "WAITING", "LATEST"], &[2], lines)
}
