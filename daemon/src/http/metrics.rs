//! Metrics over HTTP.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use relief_api::path;

use super::problem::Refusal;
use super::{Context, blocking};
use crate::metrics::MEDIA_TYPE;

/// What the service counts and measures, for Prometheus.
#[utoipa::path(get, path = path::METRICS, tag = "service", operation_id = "get_metrics",
    responses((status = 200, body = String, description = "OpenMetrics text",
        content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8")))]
pub(super) async fn text(State(context): State<Context>) -> Result<Response, Refusal> {
    let text = blocking(context, |service| Ok(service.metrics_text())).await?;
    Ok(([(header::CONTENT_TYPE, MEDIA_TYPE)], text).into_response())
}
