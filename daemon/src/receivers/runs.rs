//! Hooks for the API: which there are, what they were run for, and what is still to be.

use std::collections::BTreeSet;
use std::sync::Arc;

use relief_api::{Delivery, Hook, Job, JobState, WebhookData, WebhookKind, WebhookMessage};

use super::tell::latest;
use super::{Outbox, Receivers};
use crate::error::ServiceError;
use crate::service::{Service, lock};
use crate::store::{Store, StoreError};

impl Receivers {
    /// A program that is run.
    fn hook(&self, name: &str) -> Result<Arc<Outbox>, ServiceError> {
        self.of(|kind| kind == WebhookKind::Hook, name)
            .map_err(|known| ServiceError::NoSuchHook {
                name: name.to_owned(),
                known,
            })
    }

    /// Results that a program is still to be run for, with their files.
    pub(crate) fn results_needed(&self, store: &Store) -> Result<BTreeSet<String>, StoreError> {
        let mut needed = BTreeSet::new();
        for outbox in self.all() {
            if outbox.receiver().settings.kind != WebhookKind::Hook {
                continue;
            }
            for number in store.waiting(&outbox.name)? {
                let message = store.message(&outbox.name, number)?;
                let told = message.map(|message| serde_json::from_str(&message.body));
                let told: Option<WebhookMessage> = told.and_then(Result::ok);
                needed.extend(told.and_then(|told| told.data.job).map(|job| job.result));
            }
        }
        Ok(needed)
    }
}

impl Service {
    /// The hooks, and how they do.
    pub(crate) fn list_hooks(&self) -> Result<Vec<Hook>, ServiceError> {
        let mut list = Vec::new();
        for config in &self.config().hooks {
            // One that has just been taken out, or is to be put in.
            let Ok(outbox) = self.receivers.hook(&config.name) else {
                continue;
            };
            let latest = latest(self.store.deliveries(&outbox.name)?);
            let state = lock(&outbox.state);
            list.push(Hook {
                name: config.name.clone(),
                command: config.command.clone(),
                waiting: state.due.len(),
                dropped: state.dropped,
                latest,
            });
        }
        Ok(list)
    }

    /// The log of a hook, newest first.
    pub(crate) fn hook_runs(&self, name: &str) -> Result<Vec<Delivery>, ServiceError> {
        let outbox = self.receivers.hook(name)?;
        Ok(self.store.deliveries(&outbox.name)?)
    }

    /// Runs a hook for the newest result at once, once, and waits for its end.
    pub(crate) fn test_hook(&self, name: &str) -> Result<Delivery, ServiceError> {
        self.check_running()?;
        let outbox = self.receivers.hook(name)?;
        let is_there = |job: &Job| job.state == JobState::Done && self.spool.has(&job.result);
        let newest = self.store.newest_job(is_there)?;
        let job = newest.ok_or(ServiceError::NoResult)?;
        let about = job.scan.clone();
        let data = WebhookData {
            job: Some(job),
            ..WebhookData::default()
        };
        self.test(&outbox, Some(&about), data)
    }
}
