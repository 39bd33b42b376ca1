//! Range images over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{ImageRequest, Regrid, RegridImage, ScanImage, path};

use super::openapi::Problems;
use super::problem::{Body, Refusal};
use super::query::{Params, most_nodes};
use super::{Context, blocking};
use crate::images::Wanted;

/// A scan's range image: as far as it has come, or of the columns that are kept.
///
/// Who looks on from the middle of a scan asks for it once events are being listened to, and puts
/// the columns of the events over it.
#[utoipa::path(get, path = path::SCAN_IMAGE, tag = "scans", operation_id = "get_scan_image",
    params(("scan" = String, Path, description = "Id of the scan"), ImageRequest),
    responses((status = 200, body = ScanImage), (status = 404, response = Problems),
        (status = 409, response = Problems),
        (status = 503, response = Problems)))]
pub(super) async fn get(
    State(context): State<Context>,
    Path(id): Path<String>,
    Params(request): Params<ImageRequest>,
) -> Result<Json<ScanImage>, Refusal> {
    let most = most_nodes(request.most_nodes)?;
    let (wanted, _waiting) = Wanted::new();
    blocking(context, move |service| {
        service.scan_image(&id, most, &wanted)
    })
    .await
    .map(Json)
}

/// What a kept scan's range image would be with other settings. Nothing is changed.
#[utoipa::path(post, path = path::SCAN_REGRID, tag = "scans", operation_id = "regrid_scan",
    params(("scan" = String, Path, description = "Id of the scan")),
    request_body = Option<Regrid>,
    responses((status = 200, body = RegridImage),
        (status = 404, response = Problems),
        (status = 409, response = Problems),
        (status = 503, response = Problems)))]
pub(super) async fn regrid(
    State(context): State<Context>,
    Path(id): Path<String>,
    Body(request): Body<Regrid>,
) -> Result<Json<RegridImage>, Refusal> {
    let most = most_nodes(request.most_nodes)?;
    let (wanted, _waiting) = Wanted::new();
    blocking(context, move |service| {
        service.regridded(&id, &request.settings, most, &wanted)
    })
    .await
    .map(Json)
}
