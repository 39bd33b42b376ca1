//! Work on the jobs of this service's own queue: results go straight into its spool.

use std::path::PathBuf;
use std::sync::Arc;

use deliverables::Pictures;
use job_queue::{Lease, Order, Worker};
use range_image::Monitor;
use serde_json::Value;

use super::embedded::Embedded;
use super::make::{Halt, Workpiece};
use super::progress::Progress;
use super::worker::{Craft, Hand, Made, Names};
use crate::service::{KeptGrid, Service};

/// By how much jobs are nicer than the taking of scans.
const NICER: i32 = 10;

/// Works on the service's own jobs until it stops. Runs on a thread of its own.
pub(crate) fn work(service: &Arc<Service>) {
    be_nice();
    let name = std::thread::current().name().unwrap_or("worker").to_owned();
    let pulse = service.liveness.begin(name.clone());
    Hand {
        queue: &Embedded(Arc::clone(service)),
        worker: &Worker::named(&name),
        craft: &Local(service),
        pulse: &pulse,
        is_to_stop: &|longest| service.wait_for_stop(longest),
    }
    .work();
}

/// Lets the taking of scans go first.
pub(crate) fn be_nice() {
    // On Linux this holds for this thread, and for those that it starts.
    if let Err(error) = rustix::process::nice(NICER) {
        tracing::warn!(%error, "jobs run with the priority of scans");
    }
}

/// Makes results where they are published.
pub(crate) struct Local<'a>(pub(crate) &'a Service);

impl Craft for Local<'_> {
    fn make(&self, lease: &dyn Lease, progress: &Progress<'_>) -> Made {
        match self.publish(lease, progress) {
            Ok((directory, left_out)) => Made::Done {
                result: Value::String(directory.display().to_string()),
                left_out,
            },
            Err(Halt::Asked) => Made::Stopped,
            Err(Halt::Failed { error, hint }) => Made::Failed { error, hint },
        }
    }

    fn names(&self, order: &Order) -> Names {
        let id = order.key.job;
        let job = self.0.job(id);
        Names {
            job: id.to_string(),
            scan: job.map(|job| job.scan).unwrap_or_default(),
        }
    }

    fn discard(&self, lease: &dyn Lease) {
        if let Ok(job) = self.0.job(lease.order().key.job) {
            self.0.spool.discard(&job.result);
        }
    }
}

impl Local<'_> {
    fn publish(
        &self,
        lease: &dyn Lease,
        progress: &Progress<'_>,
    ) -> Result<(PathBuf, Vec<String>), Halt> {
        let service = self.0;
        let unknown = |error| Halt::failed(error, None);
        let job = service.job(lease.order().key.job).map_err(unknown)?;
        if let Some(directory) = service.spool.published(&job.result)? {
            return Ok((directory, job.left_out));
        }
        // First, so that an unwritable spool is told at once and not after minutes.
        let incoming = service.spool.begin(&job.result)?;
        let scan = service.scan(&job.scan).map_err(unknown)?;
        let grid = service.kept_grid(&job.scan);
        let grid_path = service.grid_path(&job.scan);
        let piece = Workpiece {
            disk: &*service.disk,
            job: &job,
            scan: &scan,
            journal: &service.journal_path(&job.scan),
            grid: grid
                .as_ref()
                .map(|KeptGrid { settings }| (&*grid_path, settings)),
            threads: service.threads_of_a_job(),
            pictures: if service.is_short_of_room(service.spool.root()) {
                Pictures::LeftOut
            } else {
                Pictures::Drawn
            },
            incoming: &incoming,
        };
        let left_out = piece.make(progress)?;
        // The last moment at which a cancelled job leaves nothing behind.
        progress.check()?;
        progress.begin("publish");
        Ok((service.spool.publish(&job.result)?, left_out))
    }
}
