//! The thread of a receiver: it delivers message after message, until the receiver ends.

use std::sync::Arc;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use relief_api::{Delivery, DeliveryAttempt, DeliveryState};

use super::receiver::Verdict;
use super::{Outbox, backoff, thread_name};
use crate::config::Retry;
use crate::ids::at;
use crate::liveness::Pulse;
use crate::service::Service;
use crate::store::{Message, StoreError};

/// How long to wait for a disk that refuses something.
const DISK_RETRY: Duration = Duration::from_secs(2);
/// By how much an attempt may be late, on a machine with much to do.
const RESERVE: Duration = Duration::from_secs(60);
/// Attempts that are kept of a message.
const MOST_TRIED: usize = 30;

/// Says that the thread has ended, however it does.
struct Gone<'a>(&'a Outbox);

impl Drop for Gone<'_> {
    fn drop(&mut self) {
        self.0.change(|state| state.gone = true);
    }
}

/// Delivers until the receiver ends. Runs on a thread of its own.
pub(super) fn deliver(service: &Arc<Service>, outbox: &Arc<Outbox>) {
    let _gone = Gone(outbox);
    let pulse = service.liveness.begin(thread_name(outbox));
    while let Some(number) = outbox.next() {
        let settled = attempt(service, outbox, number, &pulse);
        pulse.rest();
        let Err(error) = settled else { continue };
        tracing::error!(
            receiver = outbox.name,
            %error,
            "cannot read or keep what becomes of a message; trying again"
        );
        if outbox.wait_for_end(DISK_RETRY) {
            return;
        }
    }
}

/// Tries a message once, and keeps what became of it.
fn attempt(
    service: &Service,
    outbox: &Outbox,
    number: u64,
    pulse: &Pulse,
) -> Result<(), StoreError> {
    let forget = || {
        outbox.change(|state| {
            state.due.remove(&number);
        });
    };
    pulse.work(RESERVE);
    let Some(mut message) = service.store.message(&outbox.name, number)? else {
        // It had to make room.
        forget();
        return Ok(());
    };
    let receiver = outbox.receiver();
    pulse.work(receiver.settings.timeout + RESERVE);
    let (tried, verdict) = receiver.attempt(&message);
    let again_in = settle(&mut message, tried, verdict, &receiver.settings.retry);
    tell(outbox, &message.delivery);
    // What came of an attempt is not forgotten because the disk refuses it: the receiver would be
    // told once more for each time that this is tried again.
    while let Err(error) = keep(service, outbox, number, &message) {
        // The disk may refuse for long, and no scan is to end for that.
        pulse.rest();
        if matches!(error, StoreError::Closed { .. }) || outbox.wait_for_end(DISK_RETRY) {
            return Err(error);
        }
        tracing::warn!(receiver = outbox.name, %error, "cannot keep what became of a message yet");
        pulse.work(RESERVE);
    }
    match again_in {
        Some(wait) => outbox.change(|state| {
            // Unless it had to make room meanwhile.
            if let Some(due) = state.due.get_mut(&number) {
                *due = Instant::now() + wait;
            }
        }),
        None => forget(),
    }
    Ok(())
}

fn keep(
    service: &Service,
    outbox: &Outbox,
    number: u64,
    message: &Message,
) -> Result<(), StoreError> {
    match message.delivery.state {
        DeliveryState::Waiting => service.store.keep_attempt(&outbox.name, number, message),
        _ => service
            .store
            .end_message(&outbox.name, number, &message.delivery),
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
fn tell(outbox: &Outbox, delivery: &Delivery) {
    let (event, attempts) = (delivery.event.as_str(), delivery.attempts);
    let error = delivery.tried.last().and_then(|tried| tried.error.clone());
    let error = error.unwrap_or_default();
    match delivery.state {
        DeliveryState::Delivered => {
            tracing::info!(receiver = outbox.name, event, attempts, "receiver told");
        }
        DeliveryState::Waiting => tracing::warn!(
            receiver = outbox.name,
            event,
            attempts,
            %error,
            next = delivery.next_attempt_at,
            "receiver not told yet"
        ),
        DeliveryState::GivenUp | DeliveryState::Dropped => tracing::error!(
            receiver = outbox.name,
            event,
            attempts,
            %error,
            "receiver not told, and given up"
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

    use relief_api::{WebhookEvent, WebhookKind};
    use storage::LocalDisk;

    use super::*;
    use crate::config::{Config, Retry};
    use crate::events::Hub;
    use crate::receivers::Receivers;
    use crate::receivers::receiver::{Receiver, Settings, Way};
    use crate::service::Kept;
    use crate::spool::Spool;
    use crate::store::{Outgoing, Store};
    use crate::tokens::Tokens;

    /// Far longer than anything takes that should happen.
    const LIMIT: Duration = Duration::from_secs(60);

    /// A receiver whose first answer sets off a defect.
    struct Defect {
        was_met: AtomicBool,
        ids: mpsc::Sender<String>,
    }

    impl Way for Defect {
        fn deliver(&self, message: &Message, _: &mut DeliveryAttempt) -> Verdict {
            self.ids.send(message.delivery.id.clone()).unwrap();
            if !self.was_met.swap(true, Ordering::AcqRel) {
                std::panic::resume_unwind(Box::new("on\npurpose"));
            }
            Verdict::Delivered
        }
    }

    fn service(folder: &std::path::Path) -> Arc<Service> {
        let kept = Kept {
            disk: Arc::new(LocalDisk),
            store: Store::open(Arc::new(LocalDisk), &folder.join("store")).unwrap(),
            spool: Spool::open(Arc::new(LocalDisk), &folder.join("spool")).unwrap(),
            tokens: Tokens::open(Arc::new(LocalDisk), &folder.join("tokens.json")).unwrap(),
            receivers: Receivers::default(),
        };
        let (config, hub) = (Config::default(), Arc::new(Hub::default()));
        Arc::new(Service::new(config, Vec::new(), hub, kept, folder.into()))
    }

    fn outgoing(id: &str) -> Outgoing {
        Outgoing {
            receiver: "lab".into(),
            message: Message {
                delivery: Delivery {
                    id: id.into(),
                    event: WebhookEvent::JobDone,
                    about: None,
                    state: DeliveryState::Waiting,
                    created_at: at(Timestamp::now()),
                    attempts: 0,
                    tried: Vec::new(),
                    next_attempt_at: None,
                },
                body: "{}".into(),
            },
        }
    }

    #[test]
    fn a_defect_costs_one_attempt_and_not_the_service() {
        let folder = tempfile::tempdir().unwrap();
        let service = service(folder.path());
        let (ids, told) = mpsc::channel();
        let was_met = AtomicBool::new(false);
        let settings = Settings {
            name: "lab".into(),
            kind: WebhookKind::Webhook,
            shown: String::new(),
            events: Vec::new(),
            timeout: LIMIT,
            retry: Retry {
                first: Duration::ZERO,
                ..Retry::default()
            },
        };
        let receiver = Receiver::new(settings, Defect { was_met, ids });
        let outbox = Arc::new(Outbox::new(receiver));
        let both = [outgoing("msg_1"), outgoing("msg_2")];
        for added in service.store.put_messages(&both).unwrap() {
            outbox.change(|state| {
                state.due.insert(added.number, Instant::now());
            });
        }
        let thread = std::thread::spawn({
            let (service, outbox) = (Arc::clone(&service), Arc::clone(&outbox));
            move || deliver(&service, &outbox)
        });
        let mut ids: Vec<String> = (0..3).map(|_| told.recv_timeout(LIMIT).unwrap()).collect();
        outbox.change(|state| state.ended = true);
        thread.join().unwrap();
        // A watchdog is content.
        assert_eq!(service.liveness.check(Instant::now()), Ok(()));
        ids.sort();
        assert_eq!(ids, ["msg_1", "msg_1", "msg_2"]);
        let mut log = service.store.deliveries("lab").unwrap();
        log.sort_by(|a, b| a.id.cmp(&b.id));
        let came_to: Vec<_> = log.iter().map(|d| (d.state, d.attempts)).collect();
        let delivered = DeliveryState::Delivered;
        assert_eq!(came_to, [(delivered, 2), (delivered, 1)]);
        assert_eq!(
            log[0].tried[0].error.as_deref(),
            Some(
                "the attempt ended unexpectedly: on purpose; this is a defect of the program: \
                 please report it"
            )
        );
        assert_eq!(log[0].tried[1].error, None);
    }
}
