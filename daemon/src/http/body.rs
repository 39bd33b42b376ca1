//! Bodies of requests: how large, and how long they may take.

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http_body_util::BodyExt;

use super::Context;
use super::problem::{self, Refusal};

/// Largest body of a request: a note of some pages, not more.
const MAX_BODY_BYTES: usize = 256 * 1024;

/// A body that is too large is still read this far, and forgotten: a client that is busy
/// sending hears the refusal only afterwards.
const MAX_DRAINED_BYTES: usize = 1024 * 1024;

/// Takes the whole body before anything is done, so that a client that sends it slowly
/// keeps nothing but its own connection.
pub(super) async fn taken_whole(
    State(context): State<Context>,
    request: Request,
    next: Next,
) -> Response {
    let (head, body) = request.into_parts();
    let announced = head
        .headers
        .get(header::CONTENT_LENGTH)
        .and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|bytes| bytes > MAX_DRAINED_BYTES as u64) {
        return problem::long_body(MAX_BODY_BYTES).into_response();
    }
    let longest = context.service.config().http.request_timeout();
    match tokio::time::timeout(longest, take(body)).await {
        Ok(Ok(bytes)) => next.run(Request::from_parts(head, Body::from(bytes))).await,
        Ok(Err(refusal)) => refusal.into_response(),
        Err(_) => problem::slow_body(longest).into_response(),
    }
}

async fn take(mut body: Body) -> Result<Vec<u8>, Refusal> {
    let mut taken = Vec::new();
    let mut bytes = 0;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| problem::broken_body(&error))?;
        let Ok(data) = frame.into_data() else {
            continue;
        };
        bytes += data.len();
        if bytes > MAX_DRAINED_BYTES {
            break;
        } else if bytes > MAX_BODY_BYTES {
            taken = Vec::new();
        } else {
            taken.extend_from_slice(&data);
        }
    }
    if bytes > MAX_BODY_BYTES {
        return Err(problem::long_body(MAX_BODY_BYTES));
    }
    Ok(taken)
}
