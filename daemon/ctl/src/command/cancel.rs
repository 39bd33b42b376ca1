//! `relief cancel`.

use relief_api::{Job, JobId, path};

use crate::failure::Failure;
use crate::output;
use crate::service::{Client, EndpointArgs};

/// Give up a queued or running job; its scan is kept
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Number of the job, as `relief jobs` lists it
    #[arg(value_name = "JOB")]
    job: JobId,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = Client::new(args.endpoint.endpoint());
    let job: Job = client
        .post(&path::job_cancel(args.job), &serde_json::json!({}))
        .await?;
    output::either(json, &job, |job| {
        format!(
            "job {} of scan {}: {}",
            job.id,
            job.scan,
            job.state.as_str()
        )
    })
}
