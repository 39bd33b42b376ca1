//! The thread of a webhook: it delivers message after message, until the webhook ends.

use std::sync::Arc;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use relief_api::{Delivery, DeliveryAttempt, DeliveryState};

use super::receiver::Verdict;
use super::{Hook, backoff};
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
        let settled = attempt(service, hook, number, &pulse);
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
fn attempt(service: &Service, hook: &Hook, number: u64, pulse: &Pulse) -> Result<(), StoreError> {
    let forget = || {
        hook.change(|state| {
            state.due.remove(&number);
        });
    };
    pulse.work(RESERVE);
    let Some(mut message) = service.store.message(&hook.name, number)? else {
        // It had to make room.
        forget();
        return Ok(());
    };
    let receiver = hook.receiver();
    pulse.work(receiver.config.timeout() + RESERVE);
    let (tried, verdict) = receiver.post(&message.delivery.id, &message.body);
    let again_in = settle(&mut message, tried, verdict, &receiver.config.retry);
    tell(hook, &message.delivery);
    // What came of an attempt is not forgotten because the disk refuses it: the receiver would be
    // told once more for each time that this is tried again.
    while let Err(error) = keep(service, hook, number, &message) {
        // The disk may refuse for long, and no scan is to end for that.
        pulse.rest();
        if matches!(error, StoreError::Closed { .. }) || hook.wait_for_end(DISK_RETRY) {
            return Err(error);
        }
        tracing::warn!(webhook = hook.name, %error, "cannot keep what became of a message yet");
        pulse.work(RESERVE);
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

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

    use relief_api::WebhookEvent;
    use storage::LocalDisk;
    use ureq::Body;
    use ureq::http::{Request, Response};

    use super::*;
    use crate::config::{Config, WebhookConfig};
    use crate::events::Hub;
    use crate::service::Kept;
    use crate::spool::Spool;
    use crate::store::{Outgoing, Store};
    use crate::tokens::Tokens;
    use crate::webhooks::Webhooks;
    use crate::webhooks::receiver::{Carrier, Receiver};

    /// Far longer than anything takes that should happen.
    const LIMIT: Duration = Duration::from_secs(60);

    /// A receiver whose first answer sets off a defect.
    struct Defect {
        was_met: AtomicBool,
        ids: mpsc::Sender<String>,
    }

    impl Carrier for Defect {
        fn carry(&self, request: Request<&str>) -> Result<Response<Body>, ureq::Error> {
            let id = request.headers()["webhook-id"].to_str().unwrap();
            self.ids.send(id.to_owned()).unwrap();
            if !self.was_met.swap(true, Ordering::AcqRel) {
                std::panic::resume_unwind(Box::new("on\npurpose"));
            }
            Ok(Response::new(Body::builder().data("")))
        }
    }

    fn service(folder: &std::path::Path) -> Arc<Service> {
        let kept = Kept {
            disk: Arc::new(LocalDisk),
            store: Store::open(Arc::new(LocalDisk), &folder.join("store")).unwrap(),
            spool: Spool::open(Arc::new(LocalDisk), &folder.join("spool")).unwrap(),
            tokens: Tokens::open(Arc::new(LocalDisk), &folder.join("tokens.json")).unwrap(),
            webhooks: Webhooks::default(),
        };
        let (config, hub) = (Config::default(), Arc::new(Hub::default()));
        Arc::new(Service::new(config, Vec::new(), hub, kept, folder.into()))
    }

    fn outgoing(id: &str) -> Outgoing {
        Outgoing {
            webhook: "lab".into(),
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
        let file = folder.path().join("secret");
        fs::write(&file, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        let mut config = WebhookConfig::new("lab", "http://127.0.0.1:9/", file);
        config.retry.first = Duration::ZERO;
        let (ids, told) = mpsc::channel();
        let was_met = AtomicBool::new(false);
        let receiver = Receiver::new(&config)
            .unwrap()
            .over(Defect { was_met, ids });
        let hook = Arc::new(Hook::new(receiver));
        let both = [outgoing("msg_1"), outgoing("msg_2")];
        for added in service.store.put_messages(&both).unwrap() {
            hook.change(|state| {
                state.due.insert(added.number, Instant::now());
            });
        }
        let thread = std::thread::spawn({
            let (service, hook) = (Arc::clone(&service), Arc::clone(&hook));
            move || deliver(&service, &hook)
        });
        let mut ids: Vec<String> = (0..3).map(|_| told.recv_timeout(LIMIT).unwrap()).collect();
        hook.change(|state| state.ended = true);
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
