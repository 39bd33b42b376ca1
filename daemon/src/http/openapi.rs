//! The API's description for programs (OpenAPI 3.1), made of the handlers themselves.

use axum::Router;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use relief_api::{Event, Problem, ScannerState, WebhookMessage, path};
use utoipa::openapi::content::ContentBuilder;
use utoipa::openapi::path::Operation;
use utoipa::openapi::response::{Response as Described, ResponseBuilder};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{OpenApi, Ref, RefOr};
use utoipa::{OpenApi as _, ToResponse};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::{
    Context, events, files, fleet, hooks, images, jobs, metrics, scanners, scans, tickets, uploads,
    webhooks,
};

/// A refused request.
pub(super) struct Problems;

impl<'r> ToResponse<'r> for Problems {
    fn response() -> (&'r str, RefOr<Described>) {
        let body = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem")));
        let response = ResponseBuilder::new()
            .description("A refused request: `type` names the kind of problem for programs")
            .content(Problem::MEDIA_TYPE, body.build());
        ("Problem", response.build().into())
    }
}

/// What is said before the endpoints.
#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Relief",
        description = "Scans of slide-table laser scanners to CAD files.\n\n\
            The service speaks HTTP/1.1 on a Unix socket, where every request is welcome whose \
            sender may open it, and on a loopback address if configured, where each request needs \
            a token (`relief token create NAME`). Within `/v1`, fields, endpoints and kinds of \
            events and problems are only ever added; ignore those that you do not know.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0"),
    ),
    tags(
        (name = "scans", description = "Taking scans, and what is kept of them"),
        (name = "jobs", description = "Making CAD files of scans"),
        (name = "results", description = "What is in the output spool"),
        (name = "scanners", description = "The scanners and their lasers"),
        (name = "events", description = "What happens, as it happens"),
        (name = "webhooks", description = "Who is told when something is done"),
        (name = "hooks", description = "What is run for each result"),
        (name = "uploads", description = "Where copies of results go"),
        (name = "tokens", description = "Who may ask; on the Unix socket only"),
        (name = "service", description = "The service itself"),
    ),
    components(schemas(Event, Problem, ScannerState, WebhookMessage)),
)]
struct Heading;

/// All endpoints but those of tokens, with their description.
pub(super) fn described() -> OpenApiRouter<Context> {
    OpenApiRouter::with_openapi(Heading::openapi())
        .routes(routes!(super::status))
        .routes(routes!(metrics::text))
        .routes(routes!(document))
        .routes(routes!(scanners::list))
        .routes(routes!(scanners::get))
        .routes(routes!(scans::abort_on))
        .routes(routes!(scans::pause_on))
        .routes(routes!(scans::resume_on))
        .routes(routes!(scanners::laser))
        .routes(routes!(scanners::lasers))
        .routes(routes!(scans::list, scans::start))
        .routes(routes!(scans::preview))
        .routes(routes!(scans::get))
        .routes(routes!(scans::abort))
        .routes(routes!(scans::pause))
        .routes(routes!(scans::resume))
        .routes(routes!(scans::rerun))
        .routes(routes!(images::get))
        .routes(routes!(images::regrid))
        .routes(routes!(files::journal))
        .routes(routes!(scans::abort_all))
        .routes(routes!(scans::pause_any))
        .routes(routes!(scans::resume_any))
        .routes(routes!(jobs::list))
        .routes(routes!(jobs::get))
        .routes(routes!(jobs::retry))
        .routes(routes!(jobs::cancel))
        .routes(routes!(files::entry))
        .routes(routes!(files::file))
        .routes(routes!(files::acknowledge))
        .routes(routes!(tickets::create))
        .routes(routes!(hooks::list))
        .routes(routes!(hooks::runs))
        .routes(routes!(hooks::test))
        .routes(routes!(uploads::list))
        .routes(routes!(uploads::runs))
        .routes(routes!(uploads::test))
        .routes(routes!(fleet::get))
        .routes(routes!(webhooks::list))
        .routes(routes!(webhooks::deliveries))
        .routes(routes!(webhooks::test))
        .routes(routes!(events::stream))
}

/// The router, and the whole description as JSON.
pub(super) fn split(described: OpenApiRouter<Context>) -> (Router<Context>, String) {
    let (router, mut document) = described.split_for_parts();
    finish(&mut document);
    // A description serialises whatever it holds.
    (router, document.to_json().unwrap_or_default())
}

/// What holds for every endpoint.
fn finish(document: &mut OpenApi) {
    env!("CARGO_PKG_VERSION").clone_into(&mut document.info.version);
    let components = document.components.get_or_insert_default();
    let bearer = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some("A token, made by `relief token create NAME`"))
        .build();
    components.add_security_scheme("token", SecurityScheme::Http(bearer));
    let (name, response) = Problems::response();
    components.responses.insert(name.to_owned(), response);
    // On the socket none is needed.
    let either = vec![
        SecurityRequirement::default(),
        SecurityRequirement::new::<_, [&str; 0], &str>("token", []),
    ];
    document.security = Some(either);
    for item in document.paths.paths.values_mut() {
        let operations = [&mut item.get, &mut item.post];
        for operation in operations.into_iter().flatten() {
            usual_problems(operation);
        }
    }
}

/// Problems that any request may meet.
fn usual_problems(operation: &mut Operation) {
    for status in [
        "400", "401", "403", "405", "408", "413", "415", "500", "503",
    ] {
        let responses = &mut operation.responses.responses;
        let problem = || RefOr::Ref(Ref::new("#/components/responses/Problem"));
        responses.entry(status.to_owned()).or_insert_with(problem);
    }
}

/// This description.
#[utoipa::path(get, path = path::OPENAPI, tag = "service", operation_id = "get_openapi",
    responses((status = 200, content_type = "application/json", body = Object)))]
async fn document(State(context): State<Context>) -> Response {
    let json = [(header::CONTENT_TYPE, "application/json")];
    (json, context.document.to_string()).into_response()
}
