//! The event stream.

use std::convert::Infallible;
use std::sync::Arc;

use axum::extract::State;
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use futures_util::{Stream, StreamExt, future, stream};
use relief_api::Event;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

use super::Context;

/// First the status, then whatever happens from then on.
pub(super) async fn stream(
    State(context): State<Context>,
) -> Sse<impl Stream<Item = Result<SseEvent, Infallible>>> {
    // In this order, so that what happens between the two is told and not lost.
    let receiver = context.service.hub.subscribe();
    let status = Arc::new(Event::Status(context.service.status()));
    let events = stream::once(future::ready(status))
        .chain(stream::unfold(receiver, next))
        .take_until(context.stop.cancelled_owned())
        .map(|event| {
            let sse = SseEvent::default().event(event.kind());
            // Events serialise whatever they hold; a comment does no harm to anybody.
            Ok(sse
                .json_data(&*event)
                .unwrap_or_else(|error| SseEvent::default().comment(error.to_string())))
        });
    Sse::new(events).keep_alive(KeepAlive::default())
}

async fn next(mut receiver: Receiver<Arc<Event>>) -> Option<(Arc<Event>, Receiver<Arc<Event>>)> {
    let event = match receiver.recv().await {
        Ok(event) => event,
        Err(RecvError::Lagged(missed)) => Arc::new(Event::Lagged { missed }),
        Err(RecvError::Closed) => return None,
    };
    Some((event, receiver))
}
