//! The event stream.

use std::convert::Infallible;

use axum::extract::State;
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use futures_util::{Stream, StreamExt, future, stream};
use relief_api::Event;

use super::Context;
use crate::events::{Heard, Subscriber, Told};

/// First the status, then whatever happens from then on.
pub(super) async fn stream(
    State(context): State<Context>,
) -> Sse<impl Stream<Item = Result<SseEvent, Infallible>>> {
    // In this order, so that what happens between the two is told and not lost.
    let subscriber = context.service.hub.subscribe();
    let status = sent(&Told::new(&Event::Status(context.service.status())));
    let events = stream::once(future::ready(status))
        .chain(stream::unfold(subscriber, next))
        .take_until(context.stop.cancelled_owned())
        .map(Ok);
    Sse::new(events).keep_alive(KeepAlive::default())
}

async fn next(mut subscriber: Subscriber) -> Option<(SseEvent, Subscriber)> {
    let event = match subscriber.next().await? {
        Heard::Event(told) => sent(&told),
        Heard::Lagged(missed) => sent(&Told::new(&Event::Lagged { missed })),
    };
    Some((event, subscriber))
}

fn sent(told: &Told) -> SseEvent {
    SseEvent::default().event(told.kind).data(&told.json)
}
