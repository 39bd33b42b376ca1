//! Jobs over HTTP.

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Json;
use relief_api::{Job, JobId, JobList};

use super::problem::Refusal;
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

pub(super) async fn list(State(context): State<Context>) -> Result<Json<JobList>, Refusal> {
    let jobs = blocking(context, |service| service.jobs()).await?;
    Ok(Json(JobList { jobs }))
}

pub(super) async fn get(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<Json<Job>, Refusal> {
    let id = number(&job)?;
    blocking(context, move |service| service.job(id))
        .await
        .map(Json)
}

pub(super) async fn retry(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let id = number(&job)?;
    let job = blocking(context, move |service| service.retry_job(id)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}

pub(super) async fn cancel(
    State(context): State<Context>,
    Path(job): Path<String>,
) -> Result<Json<Job>, Refusal> {
    let id = number(&job)?;
    blocking(context, move |service| service.cancel_job(id))
        .await
        .map(Json)
}
