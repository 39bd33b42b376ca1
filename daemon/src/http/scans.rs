//! Scans over HTTP.

use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, StatusCode};
use axum::response::Json;
use relief_api::{Aborted, Job, Part, Rerun, Scan, ScanList, ScanPreview, StartScan, path};

use super::guard::single;
use super::openapi::Problems;
use super::problem::{Body, Refusal};
use super::query::{Params, limit};
use super::{Context, blocking};

const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// What stands in the record of a scan that was ended through the API.
const ASKED: &str = "aborted on request";

/// The scans, newest first.
#[utoipa::path(get, path = path::SCANS, tag = "scans", operation_id = "list_scans", params(Part),
    responses((status = 200, body = ScanList)))]
pub(super) async fn list(
    State(context): State<Context>,
    Params(part): Params<Part>,
) -> Result<Json<ScanList>, Refusal> {
    let limit = limit(&part)?;
    blocking(context, move |service| {
        service.scans_part(part.before, limit)
    })
    .await
    .map(Json)
}

/// Starts a scan.
///
/// With an `Idempotency-Key` it may be sent again, for 24 hours: the scan that the first request
/// started is the answer, and no second one begins.
#[utoipa::path(post, path = path::SCANS, tag = "scans", operation_id = "start_scan",
    params(("Idempotency-Key" = Option<String>, Header, description = "Names this request: 1 to 200 visible ASCII characters", min_length = 1, max_length = 200, pattern = "^[!-~]+$")),
    request_body = Option<StartScan>,
    responses((status = 202, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems), (status = 422, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems), (status = 507, response = Problems)))]
pub(super) async fn start(
    State(context): State<Context>,
    headers: HeaderMap,
    Body(request): Body<StartScan>,
) -> Result<(StatusCode, Json<Scan>), Refusal> {
    let key = request_key(&headers)?;
    let scan = blocking(context, move |service| match key {
        Some(key) => service.start_scan_once(&request, key),
        None => service.start_scan(&request, None),
    });
    Ok((StatusCode::ACCEPTED, Json(scan.await?)))
}

/// Longest key of a request.
const MAX_KEY_BYTES: usize = 200;

/// The key by which a request is known if it comes again.
fn request_key(headers: &HeaderMap) -> Result<Option<String>, Refusal> {
    let Some(key) = single(headers, IDEMPOTENCY_KEY)? else {
        return Ok(None);
    };
    if key.is_empty() || key.len() > MAX_KEY_BYTES || !key.bytes().all(|b| b.is_ascii_graphic()) {
        return Err(Refusal::new(
            StatusCode::BAD_REQUEST,
            "wrong-key",
            format!("the Idempotency-Key must be 1 to {MAX_KEY_BYTES} visible ASCII characters"),
            Some("a random UUID is one"),
        ));
    }
    Ok(Some(key.to_owned()))
}

/// Says what a scan would come to, with nothing moved.
#[utoipa::path(post, path = path::SCAN_PREVIEW, tag = "scans", operation_id = "preview_scan",
    request_body = Option<StartScan>,
    responses((status = 200, body = ScanPreview), (status = 404, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn preview(
    State(context): State<Context>,
    Body(request): Body<StartScan>,
) -> Result<Json<ScanPreview>, Refusal> {
    blocking(context, move |service| service.preview_scan(&request))
        .await
        .map(Json)
}

/// One scan.
#[utoipa::path(get, path = path::SCAN, tag = "scans", operation_id = "get_scan", params(("scan" = String, Path, description = "Id of the scan")),
    responses((status = 200, body = Scan), (status = 404, response = Problems)))]
pub(super) async fn get(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.scan(&id))
        .await
        .map(Json)
}

/// Ends a scan that is under way; its laser is off when this answers.
#[utoipa::path(post, path = path::SCAN_ABORT, tag = "scans", operation_id = "abort_scan", params(("scan" = String, Path, description = "Id of the scan")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems)))]
pub(super) async fn abort(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.abort_scan(&id, ASKED))
        .await
        .map(Json)
}

/// Ends whatever scans are under way, on every scanner.
#[utoipa::path(post, path = path::ABORT, tag = "scans", operation_id = "abort_all_scans",
    responses((status = 200, body = Aborted), (status = 409, response = Problems)))]
pub(super) async fn abort_all(State(context): State<Context>) -> Result<Json<Aborted>, Refusal> {
    blocking(context, |service| service.abort_all(ASKED))
        .await
        .map(Json)
}

/// Ends a scanner's scan.
#[utoipa::path(post, path = path::SCANNER_ABORT, tag = "scanners", operation_id = "abort_scan_on", params(("scanner" = String, Path, description = "Name of the scanner")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems)))]
pub(super) async fn abort_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.abort_on(&scanner, ASKED))
        .await
        .map(Json)
}

/// Has the scan stand still between two columns, with the laser off, until it is resumed.
#[utoipa::path(post, path = path::SCAN_PAUSE, tag = "scans", operation_id = "pause_scan", params(("scan" = String, Path, description = "Id of the scan")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn pause(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.pause_scan(&id))
        .await
        .map(Json)
}

/// Pauses the only scan that is running.
#[utoipa::path(post, path = path::PAUSE, tag = "scans", operation_id = "pause_any_scan",
    responses((status = 200, body = Scan), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn pause_any(State(context): State<Context>) -> Result<Json<Scan>, Refusal> {
    blocking(context, |service| service.pause_any())
        .await
        .map(Json)
}

/// Pauses a scanner's scan.
#[utoipa::path(post, path = path::SCANNER_PAUSE, tag = "scanners", operation_id = "pause_scan_on", params(("scanner" = String, Path, description = "Name of the scanner")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn pause_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.pause_on(&scanner))
        .await
        .map(Json)
}

/// Lets a paused scan go on: a person has looked.
#[utoipa::path(post, path = path::SCAN_RESUME, tag = "scans", operation_id = "resume_scan", params(("scan" = String, Path, description = "Id of the scan")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn resume(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.resume_scan(&id))
        .await
        .map(Json)
}

/// Lets the only paused scan go on.
#[utoipa::path(post, path = path::RESUME, tag = "scans", operation_id = "resume_any_scan",
    responses((status = 200, body = Scan), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn resume_any(State(context): State<Context>) -> Result<Json<Scan>, Refusal> {
    blocking(context, |service| service.resume_any())
        .await
        .map(Json)
}

/// Lets a scanner's paused scan go on.
#[utoipa::path(post, path = path::SCANNER_RESUME, tag = "scanners", operation_id = "resume_scan_on", params(("scanner" = String, Path, description = "Name of the scanner")),
    responses((status = 200, body = Scan), (status = 404, response = Problems), (status = 409, response = Problems), (status = 502, response = Problems), (status = 503, response = Problems), (status = 504, response = Problems)))]
pub(super) async fn resume_on(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<Scan>, Refusal> {
    blocking(context, move |service| service.resume_on(&scanner))
        .await
        .map(Json)
}

/// Queues a kept scan to be processed again.
#[utoipa::path(post, path = path::SCAN_RERUN, tag = "scans", operation_id = "rerun_scan", params(("scan" = String, Path, description = "Id of the scan")),
    request_body = Option<Rerun>,
    responses((status = 202, body = Job), (status = 404, response = Problems), (status = 409, response = Problems)))]
pub(super) async fn rerun(
    State(context): State<Context>,
    Path(id): Path<String>,
    Body(request): Body<Rerun>,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let job = blocking(context, move |service| service.rerun(&id, &request)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}
