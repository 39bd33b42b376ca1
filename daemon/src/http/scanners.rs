//! Scanners over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{LaserLog, ScannerList, ScannerSummary};

use super::problem::Refusal;
use super::{Context, blocking};

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

// Both wait for whoever just writes a line to the log of a laser.

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
