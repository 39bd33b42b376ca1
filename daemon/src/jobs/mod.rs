//! The job queue: what is to be made of kept scans, across restarts.
//!
//! A job is begun at least once and published exactly once: the records say what is
//! waiting, and the result's folder, which appears by one rename, says what is done.

mod acknowledge;
mod embedded;
mod kept_columns;
mod local;
mod make;
mod progress;
mod queue;
mod worker;

use job_queue::MOST_CUT_SHORT;
use relief_api::{Event, Job, JobId, JobState, Rerun, Scan};
use scan_record::JournalReader;

use crate::config::Processing;
use crate::error::ServiceError;
use crate::ids::{now, shown_name};
use crate::service::Service;
use crate::store::Outgoing;

pub(crate) use embedded::Embedded;
pub(crate) use local::{Local, be_nice, work};
pub(crate) use make::{Halt, Workpiece};
pub(crate) use progress::Progress;
pub(crate) use queue::{Queue, StopFlag};
pub(crate) use worker::{Craft, Hand, Made, Names};

impl Service {
    /// Queues the job of a scan that has just been completed, and keeps the scan with it, and
    /// what `tell` makes of it for the webhooks.
    pub(crate) fn queue_first_job(
        &self,
        scan: &mut Scan,
        tell: impl FnOnce(&Scan) -> Vec<Outgoing>,
    ) -> Result<Job, ServiceError> {
        let job = new_job(scan, scan.id.clone(), scan.name.clone());
        self.add_job(job, scan, tell)
    }

    /// Queues a kept scan to be processed again.
    pub(crate) fn rerun(&self, id: &str, request: &Rerun) -> Result<Job, ServiceError> {
        self.check_running()?;
        let name = match request.name.as_str() {
            "" => None,
            name => Some(shown_name(name)?),
        };
        // The job is noted on the scan as it is read here: two requests at once would lose
        // one of the notes.
        let _order = self.queue.changing();
        let mut scan = self.scan(id)?;
        if !scan.state.is_over() {
            return Err(ServiceError::ScanNotOver { id: id.to_owned() });
        }
        let nothing = |why: String| ServiceError::NothingKept {
            id: id.to_owned(),
            why,
        };
        // A journal that was put back may be run again at once.
        if let Some(at) = &scan.removed_at
            && !self.journal_path(id).exists()
        {
            return Err(nothing(format!(
                "its columns were removed at {at}, by the limits of [storage]"
            )));
        }
        let mut journal =
            JournalReader::open(&self.journal_path(id)).map_err(|e| nothing(e.to_string()))?;
        // Refuses wrong settings now and not when the job's turn comes.
        kept_processing(&journal.header().settings)
            .map_err(&nothing)?
            .with_overrides(&request.settings)?;
        if !matches!(journal.next_column(), Ok(Some(_))) {
            return Err(nothing("it ended before its first column".into()));
        }
        let name = name.unwrap_or_else(|| scan.name.clone());
        let result = self.ids.next(&name, |id| {
            self.spool.has(id) || self.journal_path(id).exists()
        });
        let mut job = new_job(&scan, result, name);
        job.settings.clone_from(&request.settings);
        job.priority = request.priority;
        self.add_job(job, &mut scan, |_| Vec::new())
    }

    fn add_job(
        &self,
        job: Job,
        scan: &mut Scan,
        tell: impl FnOnce(&Scan) -> Vec<Outgoing>,
    ) -> Result<Job, ServiceError> {
        let (job, added) = self.store.add_job(job, scan, tell)?;
        self.receivers.added(added);
        self.hub.tell(Event::Job(job.clone()));
        self.queue.add(self.order_of(&job));
        Ok(job)
    }

    /// One job.
    pub(crate) fn job(&self, id: JobId) -> Result<Job, ServiceError> {
        self.store.job(id)?.ok_or(ServiceError::NoSuchJob { id })
    }

    /// Queues a job again that failed or was cancelled.
    pub(crate) fn retry_job(&self, id: JobId) -> Result<Job, ServiceError> {
        self.check_running()?;
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        if !matches!(job.state, JobState::Failed | JobState::Cancelled) {
            return Err(ServiceError::WrongJobState {
                id,
                state: job.state,
                action: "retried",
            });
        }
        let turn = job.turn + 1;
        wait_again(&mut job, turn);
        self.keep_job(&job)?;
        self.queue.add(self.order_of(&job));
        Ok(job)
    }

    /// Has a job offered anew elsewhere, as another order.
    pub(crate) fn turn_job(&self, id: JobId) -> Result<(), ServiceError> {
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        job.turn += 1;
        self.keep_job(&job)
    }

    /// Queues a job again that was cut short when the service last ended, or gives it up.
    pub(crate) fn take_up_job(&self, job: &mut Job) -> Result<(), ServiceError> {
        job.stage = None;
        if job.cut_short < MOST_CUT_SHORT {
            tracing::info!(job = job.id, scan = %job.scan, "taking up a job that was cut short");
            job.state = JobState::Queued;
            self.store.put_job(job)?;
            self.queue.add(self.order_of(job));
            return Ok(());
        }
        self.spool.discard(&job.result);
        job.state = JobState::Failed;
        job.ended_at = Some(now());
        let error = format!(
            "the service ended {} times in a row in the midst of this job, which may be the cause",
            job.cut_short
        );
        tracing::error!(job = job.id, scan = %job.scan, %error, "a job is given up");
        job.error = Some(error);
        job.hint = Some(format!(
            "look in the service's log for why it ended: if it ran out of memory, rerun the scan \
             with a larger regrid.pitch_mm; if the power failed or it was killed, try again with \
             `relief retry {}`",
            job.id
        ));
        Ok(self.put_job(job)?)
    }

    /// Cancels a job: at once if it waits, at its next opportunity if it runs.
    pub(crate) fn cancel_job(&self, id: JobId) -> Result<Job, ServiceError> {
        let _order = self.queue.changing();
        let mut job = self.job(id)?;
        if self.queue.remove(id) {
            job.state = JobState::Cancelled;
            job.ended_at = Some(now());
            self.keep_job(&job)?;
            return Ok(job);
        }
        if self.queue.cancel_running(id) {
            return Ok(job);
        }
        Err(ServiceError::WrongJobState {
            id,
            state: job.state,
            action: "cancelled",
        })
    }

    /// Keeps a job's record and tells of it.
    pub(crate) fn keep_job(&self, job: &Job) -> Result<(), ServiceError> {
        self.put_job(job)?;
        self.hub.tell(Event::Job(job.clone()));
        Ok(())
    }
}

/// A job that came to an end is queued anew.
fn wait_again(job: &mut Job, turn: u32) {
    job.turn = turn;
    job.state = JobState::Queued;
    job.cut_short = 0;
    job.error = None;
    job.hint = None;
    job.ended_at = None;
    job.timings.clear();
    job.left_out.clear();
}

/// A job as it is queued; its number is given when it is kept.
fn new_job(scan: &Scan, result: String, name: String) -> Job {
    Job {
        id: 0,
        scan: scan.id.clone(),
        scanner: scan.scanner.clone(),
        result,
        name,
        state: JobState::Queued,
        error: None,
        hint: None,
        priority: scan.priority,
        turn: 0,
        attempts: 0,
        cut_short: 0,
        queued_at: now(),
        started_at: None,
        ended_at: None,
        worker: None,
        stage: None,
        timings: Vec::new(),
        directory: None,
        left_out: Vec::new(),
        settings: relief_api::SettingOverrides::new(),
        acknowledged_at: None,
        acknowledged_by: None,
    }
}

/// The settings that were kept with a scan.
pub(crate) fn kept_processing(settings: &[u8]) -> Result<Processing, String> {
    serde_json::from_slice(settings)
        .map_err(|error| format!("the settings kept with it cannot be read ({error})"))
}
