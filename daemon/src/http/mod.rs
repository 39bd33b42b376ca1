//! The HTTP API on a Unix socket and, if configured, on a loopback address.
//!
//! Handlers only translate; what is done, the service does. What may block runs on
//! tokio's blocking threads.

mod body;
mod events;
mod files;
mod guard;
mod jobs;
mod listen;
mod problem;
mod scanners;
mod scans;
mod serve;
mod stall;
mod tokens;
mod webhooks;

use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::middleware::from_fn_with_state;
use axum::response::Json;
use axum::routing::{any, get, post};
use relief_api::{Status, path};
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

pub use listen::ListenError;
pub(crate) use listen::{bind_loopback, bind_socket, check_handed_over};
pub(crate) use serve::serve;

use crate::service::Service;
use problem::Refusal;

/// What handlers need.
#[derive(Clone)]
pub(crate) struct Context {
    pub(crate) service: Arc<Service>,
    /// Ends the event streams, which would otherwise keep their connections for ever.
    pub(crate) stop: CancellationToken,
    /// Places for those who listen to events.
    pub(crate) listeners: Arc<Semaphore>,
}

/// All endpoints, as they are offered on the socket, whose file mode tells who may ask.
pub(crate) fn on_socket(context: &Context) -> Router {
    let tokens = Router::new()
        .route(path::TOKENS, get(tokens::list).post(tokens::create))
        .route(path::TOKEN_REVOKE, post(tokens::revoke));
    complete(tokens, context)
}

/// The endpoints for bearers of a token, as they are offered on a loopback address.
pub(crate) fn on_loopback(context: &Context) -> Router {
    let tokens = Router::new()
        .route(path::TOKENS, any(tokens::only_on_the_socket))
        .route(path::TOKEN_REVOKE, any(tokens::only_on_the_socket));
    // Places of their own: bearers of tokens must not take those of the socket.
    let listeners = context.service.config().http.listeners;
    let context = Context {
        listeners: Arc::new(Semaphore::new(listeners)),
        ..context.clone()
    };
    complete(tokens, &context).layer(from_fn_with_state(context, guard::bearers_only))
}

fn complete(tokens: Router<Context>, context: &Context) -> Router {
    tokens
        .route(path::STATUS, get(status))
        .route(path::LASER, get(scanners::lasers))
        .route(path::SCANNERS, get(scanners::list))
        .route(path::SCANNER, get(scanners::get))
        .route(path::SCANNER_ABORT, post(scans::abort_on))
        .route(path::SCANNER_PAUSE, post(scans::pause_on))
        .route(path::SCANNER_RESUME, post(scans::resume_on))
        .route(path::SCANNER_LASER, get(scanners::laser))
        .route(path::SCANS, get(scans::list).post(scans::start))
        .route(path::SCAN_PREVIEW, post(scans::preview))
        .route(path::SCAN, get(scans::get))
        .route(path::SCAN_ABORT, post(scans::abort))
        .route(path::SCAN_PAUSE, post(scans::pause))
        .route(path::SCAN_RESUME, post(scans::resume))
        .route(path::SCAN_RERUN, post(scans::rerun))
        .route(path::SCAN_JOURNAL, get(files::journal))
        .route(path::ABORT, post(scans::abort_all))
        .route(path::PAUSE, post(scans::pause_any))
        .route(path::RESUME, post(scans::resume_any))
        .route(path::JOBS, get(jobs::list))
        .route(path::JOB, get(jobs::get))
        .route(path::JOB_RETRY, post(jobs::retry))
        .route(path::JOB_CANCEL, post(jobs::cancel))
        .route(path::SPOOL, get(files::entry))
        .route(path::SPOOL_FILE, get(files::file))
        .route(path::WEBHOOKS, get(webhooks::list))
        .route(path::WEBHOOK_DELIVERIES, get(webhooks::deliveries))
        .route(path::WEBHOOK_TEST, post(webhooks::test))
        .route(path::EVENTS, get(events::stream))
        .fallback(problem::no_such_path)
        .method_not_allowed_fallback(problem::no_such_method)
        .layer(from_fn_with_state(context.clone(), body::taken_whole))
        .with_state(context.clone())
}

// Waits for whoever just writes a record, or a line to the log of a laser.
async fn status(State(context): State<Context>) -> Result<Json<Status>, Refusal> {
    let status = blocking(context, |service| Ok(service.status()));
    status.await.map(Json)
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
