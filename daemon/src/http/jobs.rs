//! Jobs over HTTP.

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Json;
use relief_api::{Job, JobId, JobList, Part, path};

use super::openapi::Problems;
use super::problem::Refusal;
use super::query::{Params, limit, wrong_query};
use super::{Context, blocking};

/// Jobs have numbers; whatever else is asked for is not there.
fn number(text: &str) -> Result<JobId, Refusal> {
    text.parse().map_err(|_| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "no-such-job",
            format!("there is no job {text}: jobs have numbers"),
            Some("`relief jobs` lists the jobs there are"),
        )
    })
}

/// The jobs, newest first.
#[utoipa::path(get, path = path::JOBS, tag = "jobs", operation_id = "list_jobs", params(Part),
    responses((status = 200, body = JobList)))]
pub(super) async fn list(
    State(context): State<Context>,
    Params(part): Params<Part>,
) -> Result<Json<JobList>, Refusal> {
    let limit = limit(&part)?;
    let before = part.before.map(|text| {
        text.parse()
            .map_err(|_| wrong_query(format!("`before` is {text}, but jobs have numbers")))
    });
    let before = before.transpose()?;
    blocking(context, move |service| service.jobs_part(before, limit))
        .await
        .map(Json)
}

/// One job.
#[utoipa::path(get, path = path::JOB, tag = "jobs", operation_id = "get_job",
    params(("job" = JobId, Path, description = "Number of the job")),
    responses((status = 200, body = Job), (status = 404, response = Problems)))]
pub(super) async fn get(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<Json<Job>, Refusal> {
    let id = number(&job)?;
    blocking(context, move |service| service.job(id))
        .await
        .map(Json)
}

/// Queues a job again that failed or was cancelled.
#[utoipa::path(post, path = path::JOB_RETRY, tag = "jobs", operation_id = "retry_job",
    params(("job" = JobId, Path, description = "Number of the job")),
    responses((status = 202, body = Job), (status = 404, response = Problems),
        (status = 409, response = Problems)))]
pub(super) async fn retry(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let id = number(&job)?;
    let job = blocking(context, move |service| service.retry_job(id)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}

/// Cancels a job that waits or runs.
#[utoipa::path(post, path = path::JOB_CANCEL, tag = "jobs", operation_id = "cancel_job",
    params(("job" = JobId, Path, description = "Number of the job")),
    responses((status = 200, body = Job), (status = 404, response = Problems),
        (status = 409, response = Problems)))]
pub(super) async fn cancel(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<Json<Job>, Refusal> {
    let id = number(&job)?;
    blocking(context, move |service| service.cancel_job(id))
        .await
        .map(Json)
}
