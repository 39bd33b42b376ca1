//! Hooks and uploads for the API: which there are, for which results they were run, and what is
//! still to be.

use std::collections::BTreeSet;
use std::sync::Arc;

use relief_api::{Delivery, Hook, Job, JobState, Upload, WebhookData, WebhookKind, WebhookMessage};

use super::tell::latest;
use super::{Outbox, Receivers, is_for_results};
use crate::error::ServiceError;
use crate::service::{Service, lock};
use crate::store::{Store, StoreError};

impl Receivers {
    /// Where copies go.
    fn upload(&self, name: &str) -> Result<Arc<Outbox>, ServiceError> {
        self.of(|kind| kind == WebhookKind::Upload, name)
            .map_err(|known| ServiceError::NoSuchUpload {
                name: name.to_owned(),
                known,
            })
    }

    /// A program that is run.
    fn hook(&self, name: &str) -> Result<Arc<Outbox>, ServiceError> {
        self.of(|kind| kind == WebhookKind::Hook, name)
            .map_err(|known| ServiceError::NoSuchHook {
                name: name.to_owned(),
                known,
            })
    }

    /// Results that a program is still to be run for, or that are still to be copied.
    pub(crate) fn results_needed(&self, store: &Store) -> Result<BTreeSet<String>, StoreError> {
        let mut needed = BTreeSet::new();
        for outbox in self.all() {
            if !is_for_results(outbox.receiver().settings.kind) {
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
        self.test_with_newest(&outbox)
    }

    /// The uploads, and how they do.
    pub(crate) fn list_uploads(&self) -> Result<Vec<Upload>, ServiceError> {
        let mut list = Vec::new();
        for config in &self.config().uploads {
            // One that has just been taken out, or is to be put in.
            let Ok(outbox) = self.receivers.upload(&config.name) else {
                continue;
            };
            let latest = latest(self.store.deliveries(&outbox.name)?);
            let state = lock(&outbox.state);
            list.push(Upload {
                name: config.name.clone(),
                to: state.receiver.settings.shown.clone(),
                waiting: state.due.len(),
                dropped: state.dropped,
                latest,
            });
        }
        Ok(list)
    }

    /// The log of an upload, newest first.
    pub(crate) fn upload_runs(&self, name: &str) -> Result<Vec<Delivery>, ServiceError> {
        let outbox = self.receivers.upload(name)?;
        Ok(self.store.deliveries(&outbox.name)?)
    }

    /// Copies the newest result at once, once, and waits for the end of that.
    pub(crate) fn test_upload(&self, name: &str) -> Result<Delivery, ServiceError> {
        self.check_running()?;
        let outbox = self.receivers.upload(name)?;
        self.test_with_newest(&outbox)
    }

    fn test_with_newest(&self, outbox: &Outbox) -> Result<Delivery, ServiceError> {
        let is_there = |job: &Job| job.state == JobState::Done && self.spool.has(&job.result);
        let newest = self.store.newest_job(is_there)?;
        let job = newest.ok_or(ServiceError::NoResult)?;
        let about = job.scan.clone();
        let data = WebhookData {
            job: Some(job),
            ..WebhookData::default()
        };
        self.test(outbox, Some(&about), data)
    }
}
