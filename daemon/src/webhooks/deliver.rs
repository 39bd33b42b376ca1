//! The thread of a webhook: it delivers message after message, until the webhook ends.

use std::sync::Arc;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use relief_api::{Delivery, DeliveryAttempt, DeliveryState};

use super::receiver::Verdict;
use super::{Hook, backoff};
use crate::config::Retry;
use crate::ids::at;
use crate::service::Service;
use crate::store::{Message, StoreError};

/// How long to wait for a disk that refuses something.
const DISK_RETRY: Duration = Duration::from_secs(2);
/// By how much an attempt may be late, on a machine with much to do.
const RESERVE: Duration = Duration::from_secs(60);
/// Attempts that are kept of a message.
const MOST_TRIED: usize = 30;

/// Says that the thread has ended, however it does.
struct Gone<'a>(&'a Hook);

impl Drop for Gone<'_> {
    fn drop(&mut self) {
        self.0.change(|state| state.gone = true);
    }
}

/// Delivers until the webhook ends. Runs on a thread of its own.
pub(super) fn deliver(service: &Arc<Service>, hook: &Arc<Hook>) {
    let _gone = Gone(hook);
    let pulse = service.liveness.begin(format!("webhook {}", hook.name));
    while let Some(number) = hook.next() {
        pulse.work(hook.receiver().config.timeout() + RESERVE);
        let settled = attempt(service, hook, number);
        pulse.rest();
        let Err(error) = settled else { continue };
        tracing::error!(
            webhook = hook.name,
            %error,
            "cannot read or keep what becomes of a message; trying again"
        );
        if hook.wait_for_end(DISK_RETRY) {
            return;
        }
    }
}

/// Tries a message once, and keeps what became of it.
fn attempt(service: &Service, hook: &Hook, number: u64) -> Result<(), StoreError> {
    let forget = || {
        hook.change(|state| {
            state.due.remove(&number);
        });
    };
    let Some(mut message) = service.store.message(&hook.name, number)? else {
        // It had to make room.
        forget();
        return Ok(());
    };
    let receiver = hook.receiver();
    let (tried, verdict) = receiver.post(&message.delivery.id, &message.body);
    let again_in = settle(&mut message, tried, verdict, &receiver.config.retry);
    tell(hook, &message.delivery);
    // What came of an attempt is not forgotten because the disk refuses it: the receiver would be
    // told once more for each time that this is tried again.
    while let Err(error) = keep(service, hook, number, &message) {
        if matches!(error, StoreError::Closed { .. }) || hook.wait_for_end(DISK_RETRY) {
            return Err(error);
        }
        tracing::warn!(webhook = hook.name, %error, "cannot keep what became of a message yet");
    }
    match again_in {
        Some(wait) => hook.change(|state| {
            // Unless it had to make room meanwhile.
            if let Some(due) = state.due.get_mut(&number) {
                *due = Instant::now() + wait;
            }
        }),
        None => forget(),
    }
    Ok(())
}

fn keep(service: &Service, hook: &Hook, number: u64, message: &Message) -> Result<(), StoreError> {
    match message.delivery.state {
        DeliveryState::Waiting => service.store.keep_attempt(&hook.name, number, message),
        _ => service
            .store
            .end_message(&hook.name, number, &message.delivery),
    }
}

/// Notes an attempt on its message. Gives the time until the next one, if there is to be one.
fn settle(
    message: &mut Message,
    tried: DeliveryAttempt,
    verdict: Verdict,
    retry: &Retry,
) -> Option<Duration> {
    let delivery = &mut message.delivery;
    delivery.attempts += 1;
    delivery.tried.push(tried);
    let surplus = delivery.tried.len().saturating_sub(MOST_TRIED);
    delivery.tried.drain(..surplus);
    delivery.next_attempt_at = None;
    let now = Timestamp::now();
    // Of a time that cannot be read, as of one in the future, no age is known.
    let created: Option<Timestamp> = delivery.created_at.parse().ok();
    let age = created.and_then(|created| Duration::try_from(now.duration_since(created)).ok());
    match verdict {
        Verdict::Delivered => delivery.state = DeliveryState::Delivered,
        Verdict::Gone => delivery.state = DeliveryState::GivenUp,
        Verdict::Again if backoff::is_enough(retry, delivery.attempts, age.unwrap_or_default()) => {
            delivery.state = DeliveryState::GivenUp;
        }
        Verdict::Again => {
            let wait = backoff::delay(retry, delivery.attempts, backoff::chance());
            delivery.next_attempt_at = Some(at(now.saturating_add(wait).unwrap_or(now)));
            return Some(wait);
        }
    }
    None
}

/// Puts the outcome into the service's log.
fn tell(hook: &Hook, delivery: &Delivery) {
    let (event, attempts) = (delivery.event.as_str(), delivery.attempts);
    let error = delivery.tried.last().and_then(|tried| tried.error.clone());
    let error = error.unwrap_or_default();
    match delivery.state {
        DeliveryState::Delivered => {
            tracing::info!(webhook = hook.name, event, attempts, "webhook told");
        }
        DeliveryState::Waiting => tracing::warn!(
            webhook = hook.name,
            event,
            attempts,
            %error,
            next = delivery.next_attempt_at,
            "webhook not told yet"
        ),
        DeliveryState::GivenUp | DeliveryState::Dropped => tracing::error!(
            webhook = hook.name,
            event,
            attempts,
            %error,
            "webhook not told, and given up"
        ),
    }
}
