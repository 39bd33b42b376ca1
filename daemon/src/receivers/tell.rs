//! What receivers are told: from what happens to messages, and to the answers of the API.

use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use deliverables::hexadecimal;
use relief_api::{
    Delivery, DeliveryState, DiskRoom, Event, Job, JobState, Scan, ScannerLink, ScannerStatus,
    Webhook, WebhookData, WebhookEvent, WebhookKind, WebhookMessage,
};
use scanner_protocol::Faults;
use sha2::{Digest, Sha256};

use super::receiver::Verdict;
use super::{Outbox, Receivers, is_for_results};
use crate::error::ServiceError;
use crate::ids::now;
use crate::service::{Service, lock};
use crate::station::Station;
use crate::store::{Message, Outgoing, StoreError};

/// Bytes of an id: two are never the same.
const ID_BYTES: usize = 16;

/// What there is to tell.
struct News<'a> {
    event: WebhookEvent,
    /// What tells it from other news of its kind and time.
    of: &'a str,
    /// When it happened, by the record that it tells of.
    at: &'a str,
    /// The scan or scanner it is about.
    about: Option<&'a str>,
}

fn message(receiver: &str, news: &News<'_>, data: WebhookData) -> Message {
    let &News {
        event,
        of,
        at,
        about,
    } = news;
    let told = WebhookMessage {
        event,
        timestamp: at.to_owned(),
        data,
    };
    // Not of all that it says: when a record is kept once more, what goes with it, such as the
    // numbers of jobs, may have changed.
    let hash = Sha256::digest(format!("{receiver}\n{}\n{at}\n{of}", event.as_str()));
    Message {
        delivery: Delivery {
            id: format!("msg_{}", hexadecimal(&hash[..ID_BYTES])),
            event,
            about: about.map(str::to_owned),
            state: DeliveryState::Waiting,
            // It has its time from now on, however late the disk took its record.
            created_at: now(),
            attempts: 0,
            tried: Vec::new(),
            next_attempt_at: None,
        },
        // Messages serialise whatever they hold.
        body: serde_json::to_string(&told).unwrap_or_default(),
    }
}

/// Whether this trouble is that somebody, or an open door, has stopped the scanner: what is wrong
/// is told in the words that the protocol has for faults.
fn is_stopped(problem: Option<&str>) -> bool {
    let stops = Faults::INTERLOCK | Faults::EMERGENCY_STOP;
    let mut named = Faults::NAMED.iter();
    problem.is_some_and(|problem| {
        named.any(|(fault, words)| stops.contains(*fault) && problem.contains(words))
    })
}

/// Makes sure that only one at a time goes on. Whoever ended by a panic does not go on.
fn alone(lock: &Mutex<()>) -> Option<MutexGuard<'_, ()>> {
    match lock.try_lock() {
        Ok(guard) => Some(guard),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

/// The one tried last, of deliveries that are listed newest first.
pub(super) fn latest(mut deliveries: Vec<Delivery>) -> Option<Delivery> {
    let last_try = |delivery: &Delivery| delivery.tried.last().map(|tried| tried.at.clone());
    deliveries.retain(|delivery| !delivery.tried.is_empty());
    // Of two tried within one millisecond the last one found counts, which is to be the newer.
    deliveries.into_iter().rev().max_by_key(last_try)
}

impl Outbox {
    fn hears(&self, event: WebhookEvent) -> bool {
        self.receiver().settings.events.contains(&event)
    }
}

impl Receivers {
    /// A message to each receiver that hears of this.
    fn outgoing(&self, news: &News<'_>, data: impl FnOnce() -> WebhookData) -> Vec<Outgoing> {
        let mut outboxes = self.all();
        outboxes.retain(|outbox| outbox.hears(news.event));
        if outboxes.is_empty() {
            return Vec::new();
        }
        let data = data();
        let told = outboxes.iter().map(|outbox| Outgoing {
            receiver: outbox.name.clone(),
            message: message(&outbox.name, news, data.clone()),
        });
        told.collect()
    }

    /// Messages that tell of a scan: of one that is over as of then, and of one that is not as
    /// of now.
    pub(crate) fn of_scan(&self, event: WebhookEvent, scan: &Scan) -> Vec<Outgoing> {
        let news = News {
            event,
            of: &scan.id,
            at: &scan.ended_at.clone().unwrap_or_else(now),
            about: Some(&scan.id),
        };
        self.outgoing(&news, || WebhookData {
            scanner: Some(scan.scanner.clone()),
            scan: Some(scan.clone()),
            ..WebhookData::default()
        })
    }

    /// Messages that tell of a job that is over, and of its scan, which is asked for only if
    /// somebody hears of it. Without the scan's record the job still tells which one it is.
    fn of_job(
        &self,
        event: WebhookEvent,
        job: &Job,
        scan: impl FnOnce() -> Option<Scan>,
    ) -> Vec<Outgoing> {
        let news = News {
            event,
            of: &job.id.to_string(),
            at: &job.ended_at.clone().unwrap_or_else(now),
            about: Some(&job.scan),
        };
        self.outgoing(&news, || {
            let scan = scan();
            WebhookData {
                scanner: scan.as_ref().map(|scan| scan.scanner.clone()),
                scan,
                job: Some(job.clone()),
                ..WebhookData::default()
            }
        })
    }

    /// Messages that tell of a scanner's trouble, as of now.
    fn of_trouble(
        &self,
        event: WebhookEvent,
        scanner: &str,
        status: &ScannerStatus,
    ) -> Vec<Outgoing> {
        // Other trouble may come at the same time.
        let of = format!(
            "{scanner}\n{}",
            status.problem.as_deref().unwrap_or_default()
        );
        let news = News {
            event,
            of: &of,
            at: &now(),
            about: Some(scanner),
        };
        self.outgoing(&news, || WebhookData {
            scanner: Some(scanner.to_owned()),
            status: Some(status.clone()),
            ..WebhookData::default()
        })
    }

    /// Messages that tell of a disk that gets full, as of now.
    fn of_disk(&self, disk: &DiskRoom) -> Vec<Outgoing> {
        let news = News {
            event: WebhookEvent::DiskLow,
            of: &disk.folder,
            at: &now(),
            about: None,
        };
        self.outgoing(&news, || WebhookData {
            disk: Some(disk.clone()),
            ..WebhookData::default()
        })
    }

    /// Who is told by messages.
    fn outbox(&self, name: &str) -> Result<Arc<Outbox>, ServiceError> {
        self.of(|kind| !is_for_results(kind), name)
            .map_err(|known| ServiceError::NoSuchWebhook {
                name: name.to_owned(),
                known,
            })
    }

    /// The one of this name, or the names of those there are.
    pub(super) fn of(
        &self,
        is_meant: impl Fn(WebhookKind) -> bool,
        name: &str,
    ) -> Result<Arc<Outbox>, Vec<String>> {
        let mut all = self.all();
        all.retain(|outbox| is_meant(outbox.receiver().settings.kind));
        let found = all.iter().find(|outbox| outbox.name == name).cloned();
        found.ok_or_else(|| all.iter().map(|outbox| outbox.name.clone()).collect())
    }
}

impl Service {
    /// Keeps a scan's record, with the messages that tell of it.
    pub(crate) fn put_scan_telling(
        &self,
        scan: &Scan,
        event: WebhookEvent,
    ) -> Result<(), StoreError> {
        let outgoing = self.receivers.of_scan(event, scan);
        let added = self.store.put_scan_telling(scan, &outgoing)?;
        self.receivers.added(added);
        Ok(())
    }

    /// Keeps a job's record, with the messages that tell of it if it is over.
    pub(crate) fn put_job(&self, job: &Job) -> Result<(), StoreError> {
        let event = match job.state {
            JobState::Done => WebhookEvent::JobDone,
            JobState::Failed => WebhookEvent::JobFailed,
            _ => return self.store.put_job(job),
        };
        let scan = || self.store.scan(&job.scan).ok().flatten();
        let outgoing = self.receivers.of_job(event, job, scan);
        let added = self.store.put_job_telling(job, &outgoing)?;
        self.receivers.added(added);
        Ok(())
    }

    /// Notes how a scanner does, and tells the receivers if that is new trouble.
    pub(crate) fn note_scanner(
        &self,
        station: &Station,
        link: ScannerLink,
        problem: Option<String>,
    ) {
        let Some((before, status)) = station.note(link, problem) else {
            return;
        };
        if status.link == ScannerLink::Trouble {
            let told = |event| self.receivers.of_trouble(event, station.name(), &status);
            let mut outgoing = told(WebhookEvent::ScannerTrouble);
            if is_stopped(status.problem.as_deref()) && !is_stopped(before.as_deref()) {
                outgoing.extend(told(WebhookEvent::Interlock));
            }
            match self.store.put_messages(&outgoing) {
                Ok(added) => self.receivers.added(added),
                Err(error) => {
                    tracing::error!(scanner = station.name(), %error, "receivers are not told");
                }
            }
        }
        self.hub.tell(Event::Scanner(status));
    }

    /// Tells of a disk that gets full.
    ///
    /// # Errors
    /// The disk does not keep the messages; nobody is told.
    pub(crate) fn tell_of_disk(&self, disk: &DiskRoom) -> Result<(), StoreError> {
        let outgoing = self.receivers.of_disk(disk);
        if !outgoing.is_empty() {
            self.receivers.added(self.store.put_messages(&outgoing)?);
        }
        Ok(())
    }

    /// The receivers, and how they do.
    pub(crate) fn list_webhooks(&self) -> Result<Vec<Webhook>, ServiceError> {
        let mut list = Vec::new();
        for outbox in self.receivers.all() {
            let settings = &outbox.receiver().settings;
            if is_for_results(settings.kind) {
                continue;
            }
            let latest = latest(self.store.deliveries(&outbox.name)?);
            let state = lock(&outbox.state);
            list.push(Webhook {
                name: outbox.name.clone(),
                kind: settings.kind,
                url: settings.shown.clone(),
                events: settings.events.clone(),
                waiting: state.due.len(),
                dropped: state.dropped,
                latest,
            });
        }
        Ok(list)
    }

    /// The log of a receiver, newest first.
    pub(crate) fn deliveries(&self, name: &str) -> Result<Vec<Delivery>, ServiceError> {
        let outbox = self.receivers.outbox(name)?;
        Ok(self.store.deliveries(&outbox.name)?)
    }

    /// Sends a test at once, once, and waits for what comes back.
    pub(crate) fn test_webhook(&self, name: &str) -> Result<Delivery, ServiceError> {
        self.check_running()?;
        let outbox = self.receivers.outbox(name)?;
        let data = WebhookData {
            webhook: Some(name.to_owned()),
            ..WebhookData::default()
        };
        self.test(&outbox, None, data)
    }

    /// Tries once, at once, and keeps what comes of it.
    pub(super) fn test(
        &self,
        outbox: &Outbox,
        about: Option<&str>,
        data: WebhookData,
    ) -> Result<Delivery, ServiceError> {
        let name = outbox.name.as_str();
        let Some(_alone) = alone(&outbox.testing) else {
            return Err(ServiceError::WebhookBusy {
                name: name.to_owned(),
            });
        };
        let news = News {
            event: WebhookEvent::Test,
            of: name,
            at: &now(),
            about,
        };
        let message = message(name, &news, data);
        let (tried, verdict) = outbox.receiver().attempt(&message);
        let mut delivery = message.delivery;
        delivery.attempts = 1;
        delivery.tried.push(tried);
        delivery.state = match verdict {
            Verdict::Delivered => DeliveryState::Delivered,
            Verdict::Again | Verdict::Gone => DeliveryState::GivenUp,
        };
        // Who asked for it hears of it anyway.
        if let Err(error) = self.store.log_delivery(name, &delivery) {
            tracing::warn!(receiver = name, %error, "cannot keep the outcome of a test");
        }
        Ok(delivery)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;
    use std::sync::Arc;

    use storage::LocalDisk;

    use super::*;
    use crate::config::{Config, WebhookConfig};
    use crate::store::Store;

    /// Receivers of which one is told of everything, and a store.
    fn webhooks() -> (tempfile::TempDir, Receivers, Store) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("secret");
        fs::write(&file, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        let store = Store::open(Arc::new(LocalDisk), &folder.path().join("store")).unwrap();
        let mut config = WebhookConfig::new("lab", "http://127.0.0.1:9/", file);
        config.events = WebhookEvent::CHOICES.to_vec();
        let config = Config {
            webhooks: vec![config],
            ..Config::default()
        };
        let webhooks = Receivers::open(&config, &store).unwrap();
        (folder, webhooks, store)
    }

    fn ended_scan() -> Scan {
        serde_json::from_value(serde_json::json!({
            "id": "20261122T095900.000Z-roof",
            "name": "roof",
            "scanner": "left",
            "state": "complete",
            "started_at": "2026-11-22T09:59:00.000Z",
            "ended_at": "2026-11-22T10:00:00.000Z",
        }))
        .unwrap()
    }

    fn told(outgoing: &[Outgoing]) -> WebhookMessage {
        assert_eq!(outgoing.len(), 1);
        serde_json::from_str(&outgoing[0].message.body).unwrap()
    }

    #[test]
    fn a_scan_whose_record_is_kept_twice_is_told_once() {
        let (_folder, webhooks, store) = webhooks();
        let mut scan = ended_scan();
        let keep = |scan: &Scan| {
            let outgoing = webhooks.of_scan(WebhookEvent::ScanEnded, scan);
            assert_eq!(told(&outgoing).timestamp, "2026-11-22T10:00:00.000Z");
            let added = store.put_scan_telling(scan, &outgoing).unwrap();
            added[0].number
        };
        assert_eq!(keep(&scan), 1);
        // Its job may have got another number meanwhile.
        scan.jobs = vec![2];
        assert_eq!(keep(&scan), 1);
        assert_eq!(store.scan(&scan.id).unwrap(), Some(scan.clone()));
        assert_eq!(store.waiting("lab").unwrap(), [1]);
        scan.ended_at = Some("2026-11-22T10:00:00.001Z".into());
        let other = webhooks.of_scan(WebhookEvent::ScanEnded, &scan);
        assert_eq!(store.put_messages(&other).unwrap()[0].number, 2);
    }

    #[test]
    fn a_job_whose_record_is_kept_twice_is_told_once() {
        let (_folder, webhooks, store) = webhooks();
        let mut job: Job = serde_json::from_value(serde_json::json!({
            "id": 1,
            "scan": "20261122T095900.000Z-roof",
            "result": "20261122T095900.000Z-roof",
            "name": "roof",
            "state": "done",
            "queued_at": "2026-11-22T10:00:00.000Z",
            "ended_at": "2026-11-22T10:01:00.000Z",
        }))
        .unwrap();
        let keep = |job: &Job, scan: Option<Scan>| {
            let outgoing = webhooks.of_job(WebhookEvent::JobDone, job, || scan.clone());
            let told = told(&outgoing);
            assert_eq!(Some(&told.timestamp), job.ended_at.as_ref());
            assert_eq!((told.data.job.as_ref(), told.data.scan), (Some(job), scan));
            store.put_job_telling(job, &outgoing).unwrap()[0].number
        };
        assert_eq!(keep(&job, None), 1);
        assert_eq!(keep(&job, Some(ended_scan())), 1);
        // Another that ended at the same time, and the first once it was tried again.
        job.id = 2;
        assert_eq!(keep(&job, None), 2);
        job.id = 1;
        job.ended_at = Some("2026-11-22T10:02:00.000Z".into());
        assert_eq!(keep(&job, None), 3);
        assert_eq!(store.waiting("lab").unwrap(), [1, 2, 3]);
    }

    #[test]
    fn a_message_is_known_by_what_it_tells_of() {
        let of = |webhook: &str, scanner: &str| {
            let data = WebhookData {
                scanner: Some(scanner.into()),
                ..WebhookData::default()
            };
            let news = News {
                event: WebhookEvent::ScannerTrouble,
                of: scanner,
                at: "2026-11-22T10:00:00.000Z",
                about: None,
            };
            message(webhook, &news, data)
        };
        let told = of("a", "left");
        assert_eq!(
            told.body,
            r#"{"type":"scanner-trouble","timestamp":"2026-11-22T10:00:00.000Z","data":{"scanner":"left"}}"#
        );
        let again = of("a", "left");
        assert_eq!(
            (again.delivery.id, again.body),
            (told.delivery.id.clone(), told.body)
        );
        assert_eq!(told.delivery.id.len(), "msg_".len() + 2 * ID_BYTES);
        for other in [of("b", "left"), of("a", "right")] {
            assert_ne!(told.delivery.id, other.delivery.id);
        }
    }

    #[test]
    fn of_two_tried_in_one_millisecond_the_newer_is_the_latest() {
        let tried = |id: &str, at: Option<&str>| -> Delivery {
            let tried: Vec<_> = at
                .map(|at| serde_json::json!({ "at": at, "milliseconds": 1 }))
                .into_iter()
                .collect();
            serde_json::from_value(serde_json::json!({
                "id": id,
                "event": "test",
                "state": "delivered",
                "created_at": "2026-11-22T10:00:00.000Z",
                "attempts": tried.len(),
                "tried": tried,
            }))
            .unwrap()
        };
        let (earlier, later) = ("2026-11-22T10:00:00.001Z", "2026-11-22T10:00:00.002Z");
        let newest_first = vec![
            tried("untried", None),
            tried("d", Some(earlier)),
            tried("c", Some(later)),
            tried("b", Some(later)),
            tried("a", Some(earlier)),
        ];
        assert_eq!(latest(newest_first).unwrap().id, "c");
        assert_eq!(latest(vec![tried("untried", None)]), None);
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
