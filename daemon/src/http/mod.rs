//! The HTTP API on a Unix socket and, if configured, on a loopback address.
//!
//! Handlers only translate; what is done, the service does. What may block runs on
//! tokio's blocking threads.

mod body;
mod download;
mod events;
mod files;
mod fleet;
mod guard;
mod hooks;
mod images;
mod jobs;
mod listen;
mod metrics;
mod openapi;
mod page;
mod problem;
mod query;
mod scanners;
mod scans;
mod serve;
mod stall;
mod tickets;
mod tokens;
mod uploads;
mod webhooks;

use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::middleware::from_fn_with_state;
use axum::response::Json;
use axum::routing::any;
use relief_api::{Status, path};
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

pub use listen::ListenError;
pub(crate) use listen::{bind_loopback, bind_socket, check_handed_over};
pub(crate) use serve::serve;

use crate::service::Service;
use problem::Refusal;
use tickets::Tickets;

/// What handlers need.
#[derive(Clone)]
pub(crate) struct Context {
    service: Arc<Service>,
    /// Ends the event streams, which would otherwise keep their connections for ever.
    stop: CancellationToken,
    /// Places for those who listen to events.
    listeners: Arc<Semaphore>,
    tickets: Tickets,
    /// The description of all endpoints.
    document: Arc<str>,
}

impl Context {
    fn new(service: &Arc<Service>, stop: &CancellationToken, document: String) -> Self {
        Self {
            service: Arc::clone(service),
            stop: stop.clone(),
            listeners: Arc::new(Semaphore::new(service.config().http.listeners)),
            tickets: Tickets::new(),
            document: document.into(),
        }
    }
}

/// All endpoints, as they are offered on the socket, whose file mode tells who may ask.
pub(crate) fn on_socket(service: &Arc<Service>, stop: &CancellationToken) -> Router {
    let (router, document) = openapi::split(with_tokens());
    let context = Context::new(service, stop, document);
    complete(router, &context).merge(page::router())
}

/// The endpoints for bearers of a token, as they are offered on a loopback address. Places for
/// listeners are their own: bearers of tokens must not take those of the socket.
pub(crate) fn on_loopback(service: &Arc<Service>, stop: &CancellationToken) -> Router {
    // Described all the same: where they are, and that they are refused here.
    let (_, document) = openapi::split(with_tokens());
    let (router, _) = openapi::split(openapi::described());
    let router = router
        .route(path::TOKENS, any(tokens::only_on_the_socket))
        .route(path::TOKEN_REVOKE, any(tokens::only_on_the_socket));
    let context = Context::new(service, stop, document);
    complete(router, &context)
        .layer(from_fn_with_state(context.clone(), guard::bearers_only))
        .merge(page::router().layer(from_fn_with_state(context, guard::this_machine_only)))
}

/// All endpoints.
fn with_tokens() -> OpenApiRouter<Context> {
    openapi::described()
        .routes(routes!(tokens::list, tokens::create))
        .routes(routes!(tokens::revoke))
}

fn complete(router: Router<Context>, context: &Context) -> Router {
    router
        .fallback(problem::no_such_path)
        .method_not_allowed_fallback(problem::no_such_method)
        .layer(from_fn_with_state(context.clone(), body::taken_whole))
        .with_state(context.clone())
}

/// The service at a glance.
#[utoipa::path(get, path = path::STATUS, tag = "service", operation_id = "get_status",
    responses((status = 200, body = Status)))]
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
