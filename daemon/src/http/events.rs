//! The event stream.

use std::convert::Infallible;
use std::sync::Arc;

use axum::extract::State;
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use futures_util::{Stream, StreamExt, future, stream};
use relief_api::Event;
use tokio::sync::OwnedSemaphorePermit;

use super::problem::{Refusal, too_many_listeners};
use super::{Context, blocking};
use crate::events::{Heard, Subscriber, Told};

/// First the status, then whatever happens from then on.
pub(super) async fn stream(
    State(context): State<Context>,
) -> Result<Sse<impl Stream<Item = Result<SseEvent, Infallible>>>, Refusal> {
    let place = Arc::clone(&context.listeners)
        .try_acquire_owned()
        .map_err(|_| too_many_listeners(context.service.config().http.listeners))?;
    // In this order, so that what happens between the two is told and not lost.
    let subscriber = context.service.hub.subscribe();
    let status = blocking(context.clone(), |service| Ok(service.status())).await?;
    let status = sent(&Told::new(&Event::Status(Box::new(status))));
    let events = stream::once(future::ready(status))
        .chain(stream::unfold((subscriber, place), next))
        .take_until(context.stop.cancelled_owned())
        .map(Ok);
    Ok(Sse::new(events).keep_alive(KeepAlive::default()))
}

/// A subscriber, and its place among the listeners.
type Listener = (Subscriber, OwnedSemaphorePermit);

async fn next((mut subscriber, place): Listener) -> Option<(SseEvent, Listener)> {
    let event = match subscriber.next().await? {
        Heard::Event(told) => sent(&told),
        Heard::Lagged(missed) => sent(&Told::new(&Event::Lagged { missed })),
    };
    Some((event, (subscriber, place)))
}

fn sent(told: &Told) -> SseEvent {
    SseEvent::default().event(told.kind).data(&told.json)
}
