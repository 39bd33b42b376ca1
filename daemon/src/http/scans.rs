//! Scans over HTTP.

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Json;
use relief_api::{Aborted, Job, Rerun, Scan, ScanList, ScanPreview, StartScan};

use super::problem::{Body, Refusal};
use super::{Context, blocking};

/// What stands in the record of a scan that was ended through the API.
const ASKED: &str = "aborted on request";

pub(super) async fn list(State(context): State<Context>) -> Result<Json<ScanList>, Refusal> {
    let scans = blocking(context, |service| service.scans()).await?;
    Ok(Json(ScanList { scans }))
}

pub(super) async fn start(
    State(context): State<Context>,
    Body(request): Body<StartScan>,
) -> Result<(StatusCode, Json<Scan>), Refusal> {
    let scan = blocking(context, move |service| service.start_scan(&request)).await?;
    Ok((StatusCode::ACCEPTED, Json(scan)))
}

pub(super) async fn preview(
    State(context): State<Context>,
    Body(request): Body<StartScan>,
) -> Result<Json<ScanPreview>, Refusal> {
    blocking(context, move |service| service.preview_scan(&request))
        .await
        .map(Json)
}

pub(super) async fn get(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.scan(&id))
        .await
        .map(Json)
}

pub(super) async fn abort(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.abort_scan(&id, ASKED))
        .await
        .map(Json)
}

pub(super) async fn abort_all(State(context): State<Context>) -> Result<Json<Aborted>, Refusal> {
    blocking(context, |service| service.abort_all(ASKED))
        .await
        .map(Json)
}

pub(super) async fn abort_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.abort_on(&scanner, ASKED))
        .await
        .map(Json)
}

pub(super) async fn pause(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.pause_scan(&id))
        .await
        .map(Json)
}

pub(super) async fn pause_any(State(context): State<Context>) -> Result<Json<Scan>, Refusal> {
    blocking(context, |service| service.pause_any())
        .await
        .map(Json)
}

pub(super) async fn pause_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.pause_on(&scanner))
        .await
        .map(Json)
}

pub(super) async fn resume(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.resume_scan(&id))
        .await
        .map(Json)
}

pub(super) async fn resume_any(State(context): State<Context>) -> Result<Json<Scan>, Refusal> {
    blocking(context, |service| service.resume_any())
        .await
        .map(Json)
}

pub(super) async fn resume_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.resume_on(&scanner))
        .await
        .map(Json)
}

pub(super) async fn rerun(
    State(context): State<Context>,
    Path(id): Path<String>,
    Body(request): Body<Rerun>,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let job = blocking(context, move |service| service.rerun(&id, &request)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}
