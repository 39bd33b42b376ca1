//! Scanners over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{LaserLog, ScannerList, ScannerSummary, path};

use super::openapi::Problems;
use super::problem::Refusal;
use super::{Context, blocking};

// All wait for whoever just writes a record, or a line to the log of a laser.

/// The scanners, in the order of their names.
#[utoipa::path(get, path = path::SCANNERS, tag = "scanners", operation_id = "list_scanners",
    responses((status = 200, body = ScannerList)))]
pub(super) async fn list(State(context): State<Context>) -> Result<Json<ScannerList>, Refusal> {
    let scanners = blocking(context, |service| Ok(service.scanners()));
    scanners.await.map(Json)
}

/// One scanner.
#[utoipa::path(get, path = path::SCANNER, tag = "scanners", operation_id = "get_scanner", params(("scanner" = String, Path, description = "Name of the scanner")),
    responses((status = 200, body = ScannerSummary), (status = 404, response = Problems)))]
pub(super) async fn get(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<ScannerSummary>, Refusal> {
    let summary = blocking(context, move |service| {
        Ok(service.station(&scanner)?.summary())
    });
    summary.await.map(Json)
}

/// The latest changes of all lasers, oldest first.
#[utoipa::path(get, path = path::LASER, tag = "scanners", operation_id = "get_lasers",
    responses((status = 200, body = LaserLog)))]
pub(super) async fn lasers(State(context): State<Context>) -> Result<Json<LaserLog>, Refusal> {
    let entries = blocking(context, |service| Ok(service.laser_entries())).await?;
    Ok(Json(LaserLog { entries }))
}

/// The latest changes of a scanner's laser, oldest first.
#[utoipa::path(get, path = path::SCANNER_LASER, tag = "scanners", operation_id = "get_laser_of", params(("scanner" = String, Path, description = "Name of the scanner")),
    responses((status = 200, body = LaserLog), (status = 404, response = Problems)))]
pub(super) async fn laser(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<LaserLog>, Refusal> {
    let entries = blocking(context, move |service| {
        Ok(service.station(&scanner)?.laser.entries())
    });
    Ok(Json(LaserLog {
        entries: entries.await?,
    }))
}
