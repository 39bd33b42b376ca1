//! Workers elsewhere over HTTP.

use axum::extract::State;
use axum::response::Json;
use relief_api::{Fleet, path};

use super::problem::Refusal;
use super::{Context, blocking};

/// Workers elsewhere, and the jobs that go to them.
#[utoipa::path(get, path = path::FLEET, tag = "service", operation_id = "get_fleet",
    responses((status = 200, body = Fleet)))]
pub(super) async fn get(State(context): State<Context>) -> Result<Json<Fleet>, Refusal> {
    let fleet = blocking(context, |service| Ok(service.fleet_status()));
    fleet.await.map(Json)
}
