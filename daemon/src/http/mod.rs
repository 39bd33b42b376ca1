//! The HTTP API on a Unix socket and, if configured, on a loopback address.
//!
//! Handlers only translate; what is done, the service does. What may block runs on
//! tokio's blocking threads.

mod events;
mod files;
mod guard;
mod jobs;
mod listen;
mod problem;
mod scans;

use std::sync::Arc;

use axum::Router;
use axum::extract::{DefaultBodyLimit, State};
use axum::response::Json;
use axum::routing::{get, post};
use relief_api::{Status, path};
use tokio_util::sync::CancellationToken;

pub(crate) use guard::local_callers_only;
pub use listen::ListenError;
pub(crate) use listen::{bind_loopback, bind_socket};

use crate::service::Service;
use problem::Refusal;

/// Largest body of a request: a note of some pages, not more.
const MAX_BODY_BYTES: usize = 256 * 1024;

/// What handlers need.
#[derive(Clone)]
pub(crate) struct Context {
    pub(crate) service: Arc<Service>,
    /// Ends the event streams, which would otherwise keep their connections for ever.
    pub(crate) stop: CancellationToken,
}

/// All endpoints.
pub(crate) fn router(context: Context) -> Router {
    Router::new()
        .route(path::STATUS, get(status))
        .route(path::SCANS, get(scans::list).post(scans::start))
        .route(path::SCAN, get(scans::get))
        .route(path::SCAN_ABORT, post(scans::abort))
        .route(path::SCAN_RERUN, post(scans::rerun))
        .route(path::SCAN_JOURNAL, get(files::journal))
        .route(path::ABORT, post(scans::abort_any))
        .route(path::JOBS, get(jobs::list))
        .route(path::JOB, get(jobs::get))
        .route(path::JOB_RETRY, post(jobs::retry))
        .route(path::JOB_CANCEL, post(jobs::cancel))
        .route(path::SPOOL, get(files::entry))
        .route(path::SPOOL_FILE, get(files::file))
        .route(path::EVENTS, get(events::stream))
        .fallback(problem::no_such_path)
        .method_not_allowed_fallback(problem::no_such_method)
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .with_state(context)
}

async fn status(State(context): State<Context>) -> Json<Status> {
    Json(context.service.status())
}

/// Runs something that may block where blocking is allowed.
async fn blocking<T: Send + 'static>(
    context: Context,
    work: impl FnOnce(&Arc<Service>) -> Result<T, crate::error::ServiceError> + Send + 'static,
) -> Result<T, Refusal> {
    tokio::task::spawn_blocking(move || work(&context.service))
        .await
        .map_err(|_| Refusal::internal("the request ended unexpectedly"))?
        .map_err(Refusal::from)
}
