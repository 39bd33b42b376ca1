//! What webhooks are told: from what happens to messages, and to the answers of the API.

use std::sync::{Mutex, MutexGuard, TryLockError};

use deliverables::hexadecimal;
use relief_api::{
    Delivery, DeliveryState, Event, Job, JobState, Scan, ScannerLink, Webhook, WebhookData,
    WebhookEvent, WebhookMessage,
};
use sha2::{Digest, Sha256};

use super::receiver::Verdict;
use super::{Hook, Webhooks, shown_url};
use crate::error::ServiceError;
use crate::ids::now;
use crate::service::{Service, lock};
use crate::station::Station;
use crate::store::{Message, Outgoing, StoreError};

/// Bytes of an id: two are never the same.
const ID_BYTES: usize = 16;

fn message(
    webhook: &str,
    event: WebhookEvent,
    about: Option<String>,
    timestamp: &str,
    data: WebhookData,
) -> Message {
    let told = WebhookMessage {
        event,
        timestamp: timestamp.to_owned(),
        data,
    };
    // Messages serialise whatever they hold.
    let body = serde_json::to_string(&told).unwrap_or_default();
    // By what it says: where the record that it tells of is kept once more, it is the same.
    let hash = Sha256::digest(format!("{webhook}\n{body}"));
    Message {
        delivery: Delivery {
            id: format!("msg_{}", hexadecimal(&hash[..ID_BYTES])),
            event,
            about,
            state: DeliveryState::Waiting,
            created_at: timestamp.to_owned(),
            attempts: 0,
            tried: Vec::new(),
            next_attempt_at: None,
        },
        body,
    }
}

/// Makes sure that only one at a time goes on. Whoever ended by a panic does not go on.
fn alone(lock: &Mutex<()>) -> Option<MutexGuard<'_, ()>> {
    match lock.try_lock() {
        Ok(guard) => Some(guard),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

impl Hook {
    fn hears(&self, event: WebhookEvent) -> bool {
        self.receiver().config.events.contains(&event)
    }
}

impl Webhooks {
    /// A message to each webhook that hears of this.
    fn outgoing(
        &self,
        event: WebhookEvent,
        about: &str,
        data: impl FnOnce() -> WebhookData,
    ) -> Vec<Outgoing> {
        let mut hooks = self.all();
        hooks.retain(|hook| hook.hears(event));
        if hooks.is_empty() {
            return Vec::new();
        }
        let (timestamp, data) = (now(), data());
        let told = hooks.iter().map(|hook| Outgoing {
            webhook: hook.name.clone(),
            message: message(
                &hook.name,
                event,
                Some(about.to_owned()),
                &timestamp,
                data.clone(),
            ),
        });
        told.collect()
    }

    /// Messages that tell of a scan.
    pub(crate) fn of_scan(&self, event: WebhookEvent, scan: &Scan) -> Vec<Outgoing> {
        self.outgoing(event, &scan.id, || WebhookData {
            scanner: Some(scan.scanner.clone()),
            scan: Some(scan.clone()),
            ..WebhookData::default()
        })
    }

    fn hook(&self, name: &str) -> Result<std::sync::Arc<Hook>, ServiceError> {
        let all = self.all();
        let found = all.iter().find(|hook| hook.name == name).cloned();
        found.ok_or_else(|| ServiceError::NoSuchWebhook {
            name: name.to_owned(),
            known: all.iter().map(|hook| hook.name.clone()).collect(),
        })
    }
}

impl Service {
    /// Keeps a scan's record, with the messages that tell of it.
    pub(crate) fn put_scan_telling(
        &self,
        scan: &Scan,
        event: WebhookEvent,
    ) -> Result<(), StoreError> {
        let outgoing = self.webhooks.of_scan(event, scan);
        let added = self.store.put_scan_telling(scan, &outgoing)?;
        self.webhooks.added(added);
        Ok(())
    }

    /// Keeps a job's record, with the messages that tell of it if it is over.
    pub(crate) fn put_job(&self, job: &Job) -> Result<(), StoreError> {
        let event = match job.state {
            JobState::Done => WebhookEvent::JobDone,
            JobState::Failed => WebhookEvent::JobFailed,
            _ => return self.store.put_job(job),
        };
        let outgoing = self.webhooks.outgoing(event, &job.scan, || {
            // Without the scan's record the job still tells which one it is.
            let scan = self.store.scan(&job.scan).ok().flatten();
            WebhookData {
                scanner: scan.as_ref().map(|scan| scan.scanner.clone()),
                scan,
                job: Some(job.clone()),
                ..WebhookData::default()
            }
        });
        let added = self.store.put_job_telling(job, &outgoing)?;
        self.webhooks.added(added);
        Ok(())
    }

    /// Notes how a scanner does, and tells the webhooks if that is new trouble.
    pub(crate) fn note_scanner(
        &self,
        station: &Station,
        link: ScannerLink,
        problem: Option<String>,
    ) {
        let Some(status) = station.note(link, problem) else {
            return;
        };
        if status.link == ScannerLink::Trouble {
            let event = WebhookEvent::ScannerTrouble;
            let outgoing = self
                .webhooks
                .outgoing(event, station.name(), || WebhookData {
                    scanner: Some(station.name().to_owned()),
                    status: Some(status.clone()),
                    ..WebhookData::default()
                });
            match self.store.put_messages(&outgoing) {
                Ok(added) => self.webhooks.added(added),
                Err(error) => {
                    tracing::error!(scanner = station.name(), %error, "webhooks are not told");
                }
            }
        }
        self.hub.tell(Event::Scanner(status));
    }

    /// The webhooks, and how they do.
    pub(crate) fn list_webhooks(&self) -> Result<Vec<Webhook>, ServiceError> {
        let mut list = Vec::new();
        for hook in self.webhooks.all() {
            let mut deliveries = self.store.deliveries(&hook.name)?;
            let last_try =
                |delivery: &Delivery| delivery.tried.last().map(|tried| tried.at.clone());
            deliveries.retain(|delivery| !delivery.tried.is_empty());
            let latest = deliveries.into_iter().max_by_key(last_try);
            let config = &hook.receiver().config;
            let state = lock(&hook.state);
            list.push(Webhook {
                name: hook.name.clone(),
                url: shown_url(&config.url),
                events: config.events.clone(),
                waiting: state.due.len(),
                dropped: state.dropped,
                latest,
            });
        }
        Ok(list)
    }

    /// The log of a webhook, newest first.
    pub(crate) fn deliveries(&self, webhook: &str) -> Result<Vec<Delivery>, ServiceError> {
        let hook = self.webhooks.hook(webhook)?;
        Ok(self.store.deliveries(&hook.name)?)
    }

    /// Sends a test at once, once, and waits for what comes back.
    pub(crate) fn test_webhook(&self, name: &str) -> Result<Delivery, ServiceError> {
        self.check_running()?;
        let hook = self.webhooks.hook(name)?;
        let Some(_alone) = alone(&hook.testing) else {
            return Err(ServiceError::WebhookBusy {
                name: name.to_owned(),
            });
        };
        let data = WebhookData {
            webhook: Some(name.to_owned()),
            ..WebhookData::default()
        };
        let Message { mut delivery, body } = message(name, WebhookEvent::Test, None, &now(), data);
        let (tried, verdict) = hook.receiver().post(&delivery.id, &body);
        delivery.attempts = 1;
        delivery.tried.push(tried);
        delivery.state = match verdict {
            Verdict::Delivered => DeliveryState::Delivered,
            Verdict::Again | Verdict::Gone => DeliveryState::GivenUp,
        };
        // Who asked for it hears of it anyway.
        if let Err(error) = self.store.log_delivery(name, &delivery) {
            tracing::warn!(webhook = name, %error, "cannot keep the outcome of a test");
        }
        Ok(delivery)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_known_by_what_it_says() {
        let of = |webhook: &str, scanner: &str| {
            let data = WebhookData {
                scanner: Some(scanner.into()),
                ..WebhookData::default()
            };
            let at = "2026-11-22T10:00:00.000Z";
            message(webhook, WebhookEvent::ScannerTrouble, None, at, data)
        };
        let told = of("a", "left");
        assert_eq!(
            told.body,
            r#"{"type":"scanner-trouble","timestamp":"2026-11-22T10:00:00.000Z","data":{"scanner":"left"}}"#
        );
        assert_eq!(told, of("a", "left"));
        assert_eq!(told.delivery.id.len(), "msg_".len() + 2 * ID_BYTES);
        for other in [of("b", "left"), of("a", "right")] {
            assert_ne!(told.delivery.id, other.delivery.id);
        }
    }

    #[test]
    fn one_that_ended_by_a_panic_keeps_nobody_from_a_test() {
        let lock = Mutex::new(());
        let held = alone(&lock);
        assert!(held.is_some() && alone(&lock).is_none());
        drop(held);
        std::thread::scope(|scope| {
            let panicked = scope.spawn(|| {
                let _held = alone(&lock);
                std::panic::resume_unwind(Box::new("on purpose"));
            });
            assert!(panicked.join().is_err());
        });
        assert!(lock.is_poisoned());
        for _ in 0..2 {
            let held = alone(&lock);
            assert!(held.is_some() && alone(&lock).is_none());
        }
    }
}
