//! The queue of one machine: what waits and runs is in the service's records.

use std::sync::Arc;
use std::time::Duration;

use job_queue::{
    Ending, FORMAT, JobKey, JobQueue, Lease, Need, Order, Outcome, QueueError, Standing, Stop,
    Worker,
};
use relief_api::{Event, Job, JobId, JobState};
use serde_json::Value;

use super::queue::StopFlag;
use super::wait_again;
use crate::error::ServiceError;
use crate::ids::now;
use crate::service::Service;

/// The queue of one machine.
#[derive(Clone)]
pub(crate) struct Embedded(pub(crate) Arc<Service>);

impl Service {
    /// A job as a worker gets it.
    pub(crate) fn order_of(&self, job: &Job) -> Order {
        Order {
            format: FORMAT,
            key: self.key_of(job.id),
            turn: job.turn,
            priority: job.priority,
            need: Need::default(),
            body: Value::Null,
        }
    }

    /// A job among those of all benches.
    pub(crate) fn key_of(&self, job: JobId) -> JobKey {
        JobKey {
            bench: self.bench.clone(),
            job,
        }
    }

    /// Notes that a job has been begun.
    pub(crate) fn begin_job(&self, id: JobId) -> Result<Job, ServiceError> {
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        job.attempts += 1;
        // Kept before the work begins, which may be the end of this process. One that runs by
        // its record has come to an end that the disk refused to keep.
        if job.state != JobState::Running {
            job.cut_short += 1;
        }
        job.state = JobState::Running;
        job.worker = None;
        job.started_at = Some(now());
        job.ended_at = None;
        self.keep_job(&job)?;
        Ok(job)
    }

    /// Notes that a job is worked on elsewhere, or waits there again.
    pub(crate) fn note_elsewhere(
        &self,
        id: JobId,
        worker: Option<&str>,
    ) -> Result<Job, ServiceError> {
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        // Who works counts how often it was cut short.
        job.cut_short = 0;
        job.stage = None;
        if let Some(worker) = worker {
            job.state = JobState::Running;
            job.attempts += 1;
            job.worker = Some(worker.to_owned());
            job.started_at = Some(now());
        } else {
            job.state = JobState::Queued;
        }
        self.keep_job(&job)?;
        self.queue.waits_elsewhere(id, worker.is_none());
        Ok(job)
    }

    /// Notes what became of a job, and tells of it; `let_go` has it run no more, before anybody
    /// can know.
    pub(crate) fn end_job(
        &self,
        id: JobId,
        outcome: &Outcome,
        let_go: impl FnOnce(),
    ) -> Result<Job, ServiceError> {
        // Who hears of the end may cancel or retry at once, and must not meet this attempt.
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        job.timings.clone_from(&outcome.timings);
        job.cut_short = 0;
        job.ended_at = Some(now());
        job.state = outcome.ending.state();
        match &outcome.ending {
            Ending::Done { result, left_out } => {
                job.error = None;
                job.hint = None;
                job.directory = result.as_str().map(str::to_owned);
                job.left_out.clone_from(left_out);
                for told in left_out {
                    tracing::warn!(job = id, scan = %job.scan, "{told}");
                }
            }
            Ending::Failed { error, hint } => {
                job.error = Some(error.clone());
                job.hint.clone_from(hint);
            }
            Ending::Cancelled => {}
        }
        self.put_job(&job)?;
        // Before anybody can see it.
        self.metrics.job_ended(&job);
        if let Some(traces) = self.traces.get() {
            traces.job_ended(&job);
        }
        let_go();
        self.hub.tell(Event::Job(job.clone()));
        if job.state == JobState::Done {
            if job.result == job.scan {
                self.forget_grid(&job.scan);
            }
            self.hub.tell(self.published_event(&job));
        }
        Ok(job)
    }

    /// Lets a job wait again that was begun and could not go on, which was not its own fault.
    pub(crate) fn put_back_job(
        &self,
        id: JobId,
        let_go: impl FnOnce(),
    ) -> Result<(), ServiceError> {
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        job.state = JobState::Queued;
        job.cut_short = 0;
        job.stage = None;
        job.ended_at = None;
        job.timings.clear();
        self.keep_job(&job)?;
        let_go();
        self.queue.add(self.order_of(&job));
        Ok(())
    }

    fn published_event(&self, job: &Job) -> Event {
        let entry = self.spool.entry(&job.result).ok().flatten();
        Event::Published {
            job: job.id,
            scan: job.scan.clone(),
            scanner: job.scanner.clone(),
            result: job.result.clone(),
            directory: job.directory.clone().unwrap_or_default(),
            files: entry.map_or_else(Vec::new, |entry| {
                entry.files.into_iter().map(|file| file.name).collect()
            }),
        }
    }
}

fn standing_of(job: &Job) -> Standing {
    let ending = match job.state {
        JobState::Queued | JobState::Running => None,
        JobState::Done => Some(Ending::Done {
            result: job.directory.clone().map_or(Value::Null, Value::String),
            left_out: job.left_out.clone(),
        }),
        JobState::Failed => Some(Ending::Failed {
            error: job.error.clone().unwrap_or_default(),
            hint: job.hint.clone(),
        }),
        JobState::Cancelled => Some(Ending::Cancelled),
    };
    let timings = job.timings.clone();
    Standing {
        turn: job.turn,
        state: job.state,
        attempts: job.attempts,
        cut_short: job.cut_short,
        worker: job.worker.clone(),
        stage: job.stage.clone(),
        outcome: ending.map(|ending| Outcome { ending, timings }),
    }
}

fn told(error: ServiceError) -> QueueError {
    QueueError::Records(error.to_string())
}

impl Embedded {
    fn known(&self, key: &JobKey) -> Result<Option<Job>, QueueError> {
        if key.bench != self.0.bench {
            return Ok(None);
        }
        self.0
            .store
            .job(key.job)
            .map_err(|error| told(error.into()))
    }
}

impl JobQueue for Embedded {
    fn offer(&self, order: &Order) -> Result<(), QueueError> {
        let service = &self.0;
        let _order = service.queue.changing();
        let mut job = self
            .known(&order.key)?
            .ok_or_else(|| QueueError::Refused(format!("job {} has no record", order.key)))?;
        if order.turn < job.turn || (order.turn == job.turn && job.state != JobState::Queued) {
            return Ok(());
        }
        if order.turn > job.turn {
            if job.state == JobState::Running {
                return Err(QueueError::Refused(format!("job {} runs", order.key)));
            }
            wait_again(&mut job, order.turn);
            service.keep_job(&job).map_err(told)?;
        }
        // The same once more changes nothing.
        service.queue.add(order.clone());
        Ok(())
    }

    fn cancel(&self, key: &JobKey) -> Result<(), QueueError> {
        if self.known(key)?.is_none() {
            return Ok(());
        }
        match self.0.cancel_job(key.job) {
            Ok(_) | Err(ServiceError::WrongJobState { .. }) => Ok(()),
            Err(error) => Err(told(error)),
        }
    }

    fn standing(&self, key: &JobKey) -> Result<Option<Standing>, QueueError> {
        Ok(self.known(key)?.as_ref().map(standing_of))
    }

    fn take(
        &self,
        worker: &Worker,
        longest: Duration,
    ) -> Result<Option<Box<dyn Lease>>, QueueError> {
        let service = &self.0;
        let taken = service.queue.take(|order| worker.can(order), longest);
        let Some((order, flag)) = taken else {
            return Ok(None);
        };
        match service.begin_job(order.key.job) {
            Ok(job) => Ok(Some(Box::new(Held {
                service: Arc::clone(service),
                begun: standing_of(&job),
                job,
                order,
                flag,
            }))),
            Err(error) => {
                // It waits by its record, too.
                service.queue.end(order.key.job, &flag);
                service.queue.add(order);
                Err(told(error))
            }
        }
    }
}

/// A job that a worker of this machine has.
struct Held {
    service: Arc<Service>,
    job: Job,
    begun: Standing,
    order: Order,
    flag: Arc<StopFlag>,
}

impl Drop for Held {
    fn drop(&mut self) {
        self.service.queue.end(self.job.id, &self.flag);
    }
}

impl Lease for Held {
    fn order(&self) -> &Order {
        &self.order
    }

    fn begun(&self) -> &Standing {
        &self.begun
    }

    fn stop(&self) -> Option<Stop> {
        self.flag.why()
    }

    fn tell(&self, stage: &str, fraction: f64, seconds: Option<f64>) {
        self.service.hub.tell(Event::Progress {
            job: self.job.id,
            scan: self.job.scan.clone(),
            scanner: self.job.scanner.clone(),
            stage: stage.to_owned(),
            fraction,
            seconds,
        });
    }

    fn settle(&mut self, outcome: &Outcome) -> Result<Standing, QueueError> {
        let (queue, id) = (&self.service.queue, self.job.id);
        let let_go = || queue.end(id, &self.flag);
        let ended = self.service.end_job(id, outcome, let_go);
        ended
            .map(|job| standing_of(&job))
            .map_err(|error| QueueError::Records(error.to_string()))
    }

    fn give_back(&mut self) -> Result<(), QueueError> {
        let (queue, id) = (&self.service.queue, self.job.id);
        let let_go = || queue.end(id, &self.flag);
        self.service.put_back_job(id, let_go).map_err(told)
    }
}

#[cfg(test)]
mod tests {
    use job_queue::conformance::{CASES, Setting};
    use tempfile::TempDir;

    use super::*;
    use crate::service::testing::service_in;

    /// A service's records, without anybody who works on them.
    struct OnRecords {
        service: Arc<Service>,
        folder: TempDir,
    }

    impl OnRecords {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            Self {
                service: Arc::new(service_in(folder.path())),
                folder,
            }
        }
    }

    impl Setting for OnRecords {
        fn queue(&self) -> Arc<dyn JobQueue> {
            Arc::new(Embedded(Arc::clone(&self.service)))
        }

        fn key(&self, n: u64) -> JobKey {
            self.service.key_of(n)
        }

        fn prepare(&mut self, order: &Order) {
            let store = &self.service.store;
            if store.job(order.key.job).unwrap().is_none() {
                let (id, result) = (order.key.job, format!("result-{}", order.key.job));
                let job = serde_json::json!({
                    "id": id, "scan": "scan", "result": result, "name": "a", "state": "queued",
                    "priority": order.priority, "turn": order.turn, "queued_at": now(),
                });
                store
                    .put_job(&serde_json::from_value(job).unwrap())
                    .unwrap();
            }
        }

        /// Workers are threads of the service: one that dies without a word takes it along.
        fn worker_dies(&mut self, lease: Box<dyn Lease>) {
            drop(lease);
            self.restart();
        }

        fn restart(&mut self) {
            self.service.store.close();
            self.service = Arc::new(service_in(self.folder.path()));
            self.service.recover_jobs().unwrap();
        }
    }

    #[test]
    fn the_queue_of_one_machine_is_a_queue() {
        for case in CASES {
            println!("{}", case.name);
            (case.run)(&mut OnRecords::new());
        }
    }
}
