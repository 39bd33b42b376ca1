//! Webhooks over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{Delivery, DeliveryList, WebhookList};

use super::problem::Refusal;
use super::{Context, blocking};

pub(super) async fn list(State(context): State<Context>) -> Result<Json<WebhookList>, Refusal> {
    let webhooks = blocking(context, |service| service.list_webhooks()).await?;
    Ok(Json(WebhookList { webhooks }))
}

pub(super) async fn deliveries(
    State(context): State<Context>,
    Path(webhook): Path<String>,
) -> Result<Json<DeliveryList>, Refusal> {
    let deliveries = blocking(context, move |service| service.deliveries(&webhook)).await?;
    Ok(Json(DeliveryList { deliveries }))
}

// Answers once the receiver has, or its time is over.
pub(super) async fn test(
    State(context): State<Context>,
    Path(webhook): Path<String>,
) -> Result<Json<Delivery>, Refusal> {
    let tested = blocking(context, move |service| service.test_webhook(&webhook));
    tested.await.map(Json)
}
