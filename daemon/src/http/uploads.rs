//! Uploads over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{Delivery, UploadList, UploadRuns, path};

use super::openapi::Problems;
use super::problem::Refusal;
use super::{Context, blocking};

/// The uploads, in the order of the configuration.
#[utoipa::path(get, path = path::UPLOADS, tag = "uploads", operation_id = "list_uploads",
    responses((status = 200, body = UploadList)))]
pub(super) async fn list(State(context): State<Context>) -> Result<Json<UploadList>, Refusal> {
    let uploads = blocking(context, |service| service.list_uploads()).await?;
    Ok(Json(UploadList { uploads }))
}

/// What an upload has copied, newest first.
#[utoipa::path(get, path = path::UPLOAD_RUNS, tag = "uploads", operation_id = "list_copies",
    params(("upload" = String, Path, description = "Name of the upload")),
    responses((status = 200, body = UploadRuns), (status = 404, response = Problems)))]
pub(super) async fn runs(
    State(context): State<Context>,
    Path(upload): Path<String>,
) -> Result<Json<UploadRuns>, Refusal> {
    let runs = blocking(context, move |service| service.upload_runs(&upload)).await?;
    Ok(Json(UploadRuns { runs }))
}

/// Copies the newest result, once, within 25 s; answers once that is over.
#[utoipa::path(post, path = path::UPLOAD_TEST, tag = "uploads", operation_id = "test_upload",
    params(("upload" = String, Path, description = "Name of the upload")),
    responses((status = 200, body = Delivery), (status = 404, response = Problems),
        (status = 409, response = Problems)))]
pub(super) async fn test(
    State(context): State<Context>,
    Path(upload): Path<String>,
) -> Result<Json<Delivery>, Refusal> {
    let tested = blocking(context, move |service| service.test_upload(&upload));
    tested.await.map(Json)
}
