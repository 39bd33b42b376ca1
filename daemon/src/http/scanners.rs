//! Scanners over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{LaserLog, ScannerList, ScannerSummary};

use super::Context;
use super::problem::Refusal;

pub(super) async fn list(State(context): State<Context>) -> Json<ScannerList> {
    Json(context.service.scanners())
}

pub(super) async fn get(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<ScannerSummary>, Refusal> {
    let station = context.service.station(&scanner)?;
    Ok(Json(station.summary()))
}

/// The lasers of all scanners.
pub(super) async fn lasers(State(context): State<Context>) -> Json<LaserLog> {
    Json(LaserLog {
        entries: context.service.laser_entries(),
    })
}

pub(super) async fn laser(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<LaserLog>, Refusal> {
    let entries = context.service.station(&scanner)?.laser.entries();
    Ok(Json(LaserLog { entries }))
}
