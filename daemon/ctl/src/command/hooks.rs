//! `relief hooks`.

use relief_api::{Delivery, DeliveryAttempt, DeliveryState, Hook, HookList, HookRuns, path};

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
            endpoint.show(&path::hook_runs(&name), json, log).await
        }
        Some(Action::Test { name, endpoint }) => test(&name, &endpoint, json).await,
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
            latest(hook),
        ]
    });
    output::table(&["HOOK", "COMMAND", "WAITING", "LATEST"], &[2], lines)
}

fn latest(hook: &Hook) -> String {
    let Some(run) = &hook.latest else {
        return "not run yet".into();
    };
    let tried = run.tried.last();
    let outcome = tried.map_or_else(String::new, |tried| {
        format!(": {}: {}", tried.at, outcome(tried))
    });
    format!("{}{outcome}", state(run))
}

fn state(run: &Delivery) -> String {
    match (run.state, &run.next_attempt_at) {
        (DeliveryState::Delivered, _) => "done".into(),
        (DeliveryState::Waiting, Some(next)) => format!("failed, again at {next}"),
        (DeliveryState::Waiting, None) => "waiting".into(),
        (DeliveryState::GivenUp, _) => "failed".into(),
        (DeliveryState::Dropped, _) => "dropped".into(),
    }
}

fn outcome(tried: &DeliveryAttempt) -> String {
    let seconds = tried.milliseconds as f64 * 1e-3;
    let how = tried.error.as_deref().unwrap_or("done");
    format!("{how} after {seconds:.1} s")
}

/// What it said, line by line below the run.
fn said(tried: &DeliveryAttempt) -> String {
    let lines = tried.answer.iter().flat_map(|said| said.lines());
    lines.map(|line| format!("\n      {line}")).collect()
}

fn log(list: &HookRuns) -> String {
    if list.runs.is_empty() {
        return "nothing was run yet".into();
    }
    let lines = list.runs.iter().flat_map(|run| {
        let about = run.about.as_deref().unwrap_or("test");
        let heading = format!("{about}  {}", state(run));
        let tried = run
            .tried
            .iter()
            .map(|tried| format!("  {}  {}{}", tried.at, outcome(tried), said(tried)));
        std::iter::once(heading).chain(tried)
    });
    lines.collect::<Vec<String>>().join("\n")
}

async fn test(name: &str, endpoint: &EndpointArgs, json: bool) -> Result<(), Failure> {
    let client = endpoint.client()?;
    let run: Delivery = client
        .post(&path::hook_test(name), &serde_json::json!({}))
        .await?;
    let told = |run: &Delivery| {
        let tried = run.tried.last();
        tried.map_or_else(String::new, |tried| {
            format!("{name}: {}{}", outcome(tried), said(tried))
        })
    };
    let succeeded = run.state == DeliveryState::Delivered;
    // Programs get the document in either case.
    if json || succeeded {
        output::either(json, &run, told)?;
    }
    if succeeded {
        Ok(())
    } else {
        Err(Failure::Failed(told(&run)))
    }
}
