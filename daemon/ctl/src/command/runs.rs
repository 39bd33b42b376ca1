//! What became of runs: of hooks and of uploads.

use relief_api::{Delivery, DeliveryAttempt, DeliveryState};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// The latest run in a line.
pub(crate) fn latest(run: Option<&Delivery>, none: &str) -> String {
    let Some(run) = run else {
        return none.into();
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

/// Every run with every attempt.
pub(crate) fn log(runs: &[Delivery], none: &str) -> String {
    if runs.is_empty() {
        return none.into();
    }
    let lines = runs.iter().flat_map(|run| {
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

/// Tries one, and shows what comes of it.
pub(crate) async fn test(
    path: &str,
    name: &str,
    endpoint: &EndpointArgs,
    json: bool,
) -> Result<(), Failure> {
    let client = endpoint.client()?;
    let run: Delivery = client.post(path, &serde_json::json!({})).await?;
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
