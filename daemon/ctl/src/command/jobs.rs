//! `relief jobs`.

use relief_api::{Job, JobList, path};

use crate::failure::Failure;
use crate::output::of_scanners;
use crate::service::EndpointArgs;

/// List the jobs, newest first
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.endpoint.show(path::JOBS, json, told).await
}

fn told(list: &JobList) -> String {
    if list.jobs.is_empty() {
        return "no jobs yet".into();
    }
    let lines = list.jobs.iter().map(|job| {
        (
            job.scanner.as_str(),
            vec![
                job.id.to_string(),
                job.scan.clone(),
                job.name.clone(),
                seconds(job),
                state(job),
            ],
        )
    });
    of_scanners(
        &["JOB", "SCAN", "NAME", "SECONDS", "STATE"],
        2,
        &[0, 3],
        lines,
    )
}

fn seconds(job: &Job) -> String {
    if job.timings.is_empty() {
        return String::new();
    }
    format!(
        "{:.2}",
        job.timings.iter().map(|timing| timing.seconds).sum::<f64>()
    )
}

fn state(job: &Job) -> String {
    let state = job.state.as_str();
    match (&job.error, &job.hint, &job.stage) {
        (Some(error), Some(hint), _) => format!("{state}: {error}; {hint}"),
        (Some(error), None, _) => format!("{state}: {error}"),
        (None, _, Some(stage)) => match &job.worker {
            Some(worker) => format!("{state}: {stage}, on {worker}"),
            None => format!("{state}: {stage}"),
        },
        (None, _, None) if !job.left_out.is_empty() => {
            format!("{state}{}: {}", acknowledged(job), job.left_out.join("; "))
        }
        (None, _, None) => state.to_owned() + &acknowledged(job),
    }
}

/// Who has its result since when, if anybody does.
fn acknowledged(job: &Job) -> String {
    match (&job.acknowledged_at, &job.acknowledged_by) {
        (Some(at), Some(by)) => format!(", acknowledged by {by} at {at}"),
        _ => String::new(),
    }
}
