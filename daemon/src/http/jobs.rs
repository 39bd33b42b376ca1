//! Jobs over HTTP.

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Json;
use relief_api::{Job, JobId, JobList};

use super::problem::{Refusal, wrong_path};
use super::{Context, blocking};

type JobPath = Result<Path<JobId>, PathRejection>;

pub(super) async fn list(State(context): State<Context>) -> Result<Json<JobList>, Refusal> {
    let jobs = blocking(context, |service| service.jobs()).await?;
    Ok(Json(JobList { jobs }))
}

pub(super) async fn get(
    State(context): State<Context>,
    path: JobPath,
) -> Result<Json<Job>, Refusal> {
    let Path(id) = path.map_err(|e| wrong_path(&e))?;
    blocking(context, move |service| service.job(id))
        .await
        .map(Json)
}

pub(super) async fn retry(
    State(context): State<Context>,
    path: JobPath,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let Path(id) = path.map_err(|e| wrong_path(&e))?;
    let job = blocking(context, move |service| service.retry_job(id)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}

pub(super) async fn cancel(
    State(context): State<Context>,
    path: JobPath,
) -> Result<Json<Job>, Refusal> {
    let Path(id) = path.map_err(|e| wrong_path(&e))?;
    blocking(context, move |service| service.cancel_job(id))
        .await
        .map(Json)
}
