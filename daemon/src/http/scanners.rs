//! Scanners over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{LaserLog, ScannerList, ScannerSummary};

use super::problem::Refusal;
use super::{Context, blocking};

// All wait for whoever just writes a record, or a line to the log of a laser.

pub(super) async fn list(State(context): State<Context>) -> Result<Json<ScannerList>, Refusal> {
    let scanners = blocking(context, |service| Ok(service.scanners()));
    scanners.await.map(Json)
}

pub(super) async fn get(
    State(context): State<Context>,
    Path(scanner): Path<String>,
) -> Result<Json<ScannerSummary>, Refusal> {
    let summary = blocking(context, move |service| {
        Ok(service.station(&scanner)?.summary())
    });
    summary.await.map(Json)
}

/// The lasers of all scanners.
pub(super) async fn lasers(State(context): State<Context>) -> Result<Json<LaserLog>, Refusal> {
    let entries = blocking(context, |service| Ok(service.laser_entries())).await?;
    Ok(Json(LaserLog { entries }))
}

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
