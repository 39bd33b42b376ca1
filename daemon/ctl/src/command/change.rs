//! `relief cancel` and `relief retry`: changes of a job's state.

use relief_api::{Job, JobId, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Give up a queued or running job; its scan is kept
#[derive(Debug, clap::Args)]
pub(crate) struct CancelArgs {
    #[command(flatten)]
    job: JobArgs,
}

/// Queue a failed or cancelled job again
#[derive(Debug, clap::Args)]
pub(crate) struct RetryArgs {
    #[command(flatten)]
    job: JobArgs,
}

#[derive(Debug, clap::Args)]
struct JobArgs {
    /// Number of the job, as `relief jobs` lists it
    #[arg(value_name = "JOB", value_parser = job_id)]
    job: JobId,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

fn job_id(text: &str) -> Result<JobId, String> {
    text.parse()
        .map_err(|_| "jobs have numbers, which `relief jobs` lists".to_owned())
}

pub(crate) async fn cancel(args: CancelArgs, json: bool) -> Result<(), Failure> {
    change(args.job, path::job_cancel, json).await
}

pub(crate) async fn retry(args: RetryArgs, json: bool) -> Result<(), Failure> {
    change(args.job, path::job_retry, json).await
}

async fn change(args: JobArgs, path: fn(JobId) -> String, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let job: Job = client.post(&path(args.job), &serde_json::json!({})).await?;
    output::either(json, &job, |job| {
        format!(
            "job {} of scan {}: {}",
            job.id,
            job.scan,
            job.state.as_str()
        )
    })
}
