//! The event stream.

use std::convert::Infallible;
use std::sync::Arc;

use axum::extract::State;
use axum::http::{HeaderMap, HeaderName};
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use futures_util::{Stream, StreamExt, stream};
use relief_api::{Event, path};
use tokio::sync::OwnedSemaphorePermit;

use super::guard::single;
use super::openapi::Problems;
use super::problem::{Refusal, too_many_listeners};
use super::{Context, blocking};
use crate::events::{EventId, Heard, Subscriber, Told};

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// The events, as a stream of server-sent events.
///
/// First comes the status, then whatever happens from then on. Each event has an id; who comes
/// back with the id of the last one that was heard (`Last-Event-ID`) within a minute is told what
/// was missed instead of the status. Where that is not known any more, the stream begins with the
/// status like any other.
#[utoipa::path(get, path = path::EVENTS, tag = "events", operation_id = "listen",
    params(("Last-Event-ID" = Option<String>, Header, description = "Id of the last event heard")),
    responses((status = 200, content_type = "text/event-stream", body = String,
        description = "Server-sent events; the data of each is one `Event`"),
        (status = 503, response = Problems)))]
pub(super) async fn stream(
    State(context): State<Context>,
    headers: HeaderMap,
) -> Result<Sse<impl Stream<Item = Result<SseEvent, Infallible>>>, Refusal> {
    let place = Arc::clone(&context.listeners)
        .try_acquire_owned()
        .map_err(|_| too_many_listeners(context.service.config().http.listeners))?;
    // An id that is not ours is one that is not known any more.
    let last = single(&headers, LAST_EVENT_ID)?.and_then(|id| id.parse().ok());
    let resumed = last.and_then(|last| context.service.hub.resume(last));
    let (subscriber, first) = match resumed {
        Some(subscriber) => (subscriber, None),
        None => {
            // In this order, so that what happens between the two is told and not lost.
            let subscriber = context.service.hub.subscribe();
            let status = blocking(context.clone(), |service| Ok(service.status())).await?;
            let status = Told::new(&Event::Status(Box::new(status)));
            let first = sent(&status, subscriber.heard());
            (subscriber, Some(first))
        }
    };
    let events = stream::iter(first)
        .chain(stream::unfold((subscriber, place), next))
        .take_until(context.stop.cancelled_owned())
        .map(Ok);
    Ok(Sse::new(events).keep_alive(KeepAlive::default()))
}

/// A subscriber, and its place among the listeners.
type Listener = (Subscriber, OwnedSemaphorePermit);

async fn next((mut subscriber, place): Listener) -> Option<(SseEvent, Listener)> {
    let heard = subscriber.next().await?;
    let id = subscriber.heard();
    let event = match heard {
        Heard::Event(told) => sent(&told, id),
        Heard::Lagged(missed) => sent(&Told::new(&Event::Lagged { missed }), id),
    };
    Some((event, (subscriber, place)))
}

fn sent(told: &Told, id: EventId) -> SseEvent {
    SseEvent::default()
        .event(told.kind)
        .id(id.to_string())
        .data(&told.json)
}
