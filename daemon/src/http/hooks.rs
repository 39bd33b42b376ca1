//! Hooks over HTTP.

use axum::extract::{Path, State};
use axum::response::Json;
use relief_api::{Delivery, HookList, HookRuns, path};

use super::openapi::Problems;
use super::problem::Refusal;
use super::{Context, blocking};

/// The hooks, in the order of the configuration.
#[utoipa::path(get, path = path::HOOKS, tag = "hooks", operation_id = "list_hooks",
    responses((status = 200, body = HookList)))]
pub(super) async fn list(State(context): State<Context>) -> Result<Json<HookList>, Refusal> {
    let hooks = blocking(context, |service| service.list_hooks()).await?;
    Ok(Json(HookList { hooks }))
}

/// What a hook was run for, newest first.
#[utoipa::path(get, path = path::HOOK_RUNS, tag = "hooks", operation_id = "list_runs",
    params(("hook" = String, Path, description = "Name of the hook")),
    responses((status = 200, body = HookRuns), (status = 404, response = Problems)))]
pub(super) async fn runs(
    State(context): State<Context>,
    Path(hook): Path<String>,
) -> Result<Json<HookRuns>, Refusal> {
    let runs = blocking(context, move |service| service.hook_runs(&hook)).await?;
    Ok(Json(HookRuns { runs }))
}

/// Runs a hook for the newest result, once, for 25 s at most; answers once it has ended.
#[utoipa::path(post, path = path::HOOK_TEST, tag = "hooks", operation_id = "test_hook",
    params(("hook" = String, Path, description = "Name of the hook")),
    responses((status = 200, body = Delivery), (status = 404, response = Problems),
        (status = 409, response = Problems)))]
pub(super) async fn test(
    State(context): State<Context>,
    Path(hook): Path<String>,
) -> Result<Json<Delivery>, Refusal> {
    let tested = blocking(context, move |service| service.test_hook(&hook));
    tested.await.map(Json)
}
