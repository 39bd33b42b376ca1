//! Webhooks over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{Delivery, DeliveryList, WebhookList, path};

use super::openapi::Problems;
use super::problem::Refusal;
use super::{Context, blocking};

/// The webhooks, in the order of the configuration.
#[utoipa::path(get, path = path::WEBHOOKS, tag = "webhooks", operation_id = "list_webhooks",
    responses((status = 200, body = WebhookList)))]
pub(super) async fn list(State(context): State<Context>) -> Result<Json<WebhookList>, Refusal> {
    let webhooks = blocking(context, |service| service.list_webhooks()).await?;
    Ok(Json(WebhookList { webhooks }))
}

/// What a webhook was told, newest first.
#[utoipa::path(get, path = path::WEBHOOK_DELIVERIES, tag = "webhooks", operation_id = "list_deliveries", params(("webhook" = String, Path, description = "Name of the webhook")),
    responses((status = 200, body = DeliveryList), (status = 404, response = Problems)))]
pub(super) async fn deliveries(
    State(context): State<Context>,
    Path(webhook): Path<String>,
) -> Result<Json<DeliveryList>, Refusal> {
    let deliveries = blocking(context, move |service| service.deliveries(&webhook)).await?;
    Ok(Json(DeliveryList { deliveries }))
}

/// Sends a test message; answers once the receiver has, or its time is over.
#[utoipa::path(post, path = path::WEBHOOK_TEST, tag = "webhooks", operation_id = "test_webhook", params(("webhook" = String, Path, description = "Name of the webhook")),
    responses((status = 200, body = Delivery), (status = 404, response = Problems), (status = 409, response = Problems)))]
pub(super) async fn test(
    State(context): State<Context>,
    Path(webhook): Path<String>,
) -> Result<Json<Delivery>, Refusal> {
    let tested = blocking(context, move |service| service.test_webhook(&webhook));
    tested.await.map(Json)
}
