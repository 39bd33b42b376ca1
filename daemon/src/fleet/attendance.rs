//! Workers that are here, as others see them.

use std::collections::BTreeMap;
use std::sync::Mutex;

use job_queue::jetstream::{JetStreamQueue, Node, Role};
use job_queue::{JobKey, QueueError, Worker};

use crate::ids::now;
use crate::service::lock;

/// The workers of this process.
#[derive(Debug, Default)]
pub(super) struct Attendance(Mutex<BTreeMap<String, Node>>);

impl Attendance {
    /// A worker is there from now on.
    pub(super) fn comes(&self, worker: &Worker, threads: usize) {
        let node = Node {
            role: Role::Worker,
            name: worker.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            formats: (*worker.formats.start(), *worker.formats.end()),
            memory_mib: worker.memory_mib,
            tools: worker.tools.iter().cloned().collect(),
            busy_with: None,
            threads: u32::try_from(threads).unwrap_or(u32::MAX),
            waiting: 0,
            since: now(),
        };
        lock(&self.0).insert(worker.name.clone(), node);
    }

    /// What a worker is at.
    pub(super) fn is_at(&self, worker: &str, job: Option<&JobKey>) {
        if let Some(node) = lock(&self.0).get_mut(worker) {
            node.busy_with = job.cloned();
        }
    }

    /// Tells of all of them.
    pub(super) fn tell(&self, queue: &JetStreamQueue) -> Result<(), QueueError> {
        let all = lock(&self.0).clone();
        all.values().try_for_each(|node| queue.beat(node))
    }

    /// Tells that all of them end.
    pub(super) fn leave(&self, queue: &JetStreamQueue) {
        let all = lock(&self.0).clone();
        for node in all.values() {
            // Whoever hears nothing more knows it a minute later.
            let _ = queue.leave(node);
        }
    }
}
