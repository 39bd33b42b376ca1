//! A worker: takes job after job, until the service stops.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use relief_api::{Event, Job, JobState};

use super::process::process;
use super::progress::Progress;
use super::queue::StopFlag;
use crate::error::panic_text;
use crate::ids::now;
use crate::liveness::Pulse;
use crate::service::Service;

/// What became of an attempt.
#[derive(Debug)]
pub(crate) enum JobOutcome {
    /// The result is in the spool.
    Published {
        /// Its folder.
        directory: PathBuf,
        /// What is not in it that was asked for, and why.
        left_out: Vec<String>,
    },
    /// It was asked to stop.
    Stopped,
    /// It cannot be done, or not now.
    Failed {
        /// Why not.
        error: String,
        /// What to do about it.
        hint: Option<String>,
    },
}

/// By how much jobs are nicer than the taking of scans.
const NICER: i32 = 10;

/// How long a job waits whose record the disk refused.
const RETRY: Duration = Duration::from_secs(2);
/// A job looks whether it should stop far more often than this, on any machine; one that
/// does not is stuck.
const LONGEST_SILENCE: Duration = Duration::from_secs(15 * 60);

/// Works until the service stops. Runs on a thread of its own.
pub(crate) fn work(service: &Arc<Service>) {
    // On Linux this holds for this thread, and for those that it starts.
    if let Err(error) = rustix::process::nice(NICER) {
        tracing::warn!(%error, "jobs run with the priority of scans");
    }
    let name = std::thread::current().name().unwrap_or("worker").to_owned();
    let pulse = service.liveness.begin(name);
    while let Some((id, flag)) = service.queue.take() {
        pulse.work(LONGEST_SILENCE);
        let kept = attempt(service, id, &flag, &pulse);
        service.queue.end(id, &flag);
        pulse.rest();
        if let Err(error) = kept {
            // The record still says that the job waits or runs. A result that is in its place
            // is not made again.
            tracing::error!(job = id, %error, "cannot keep the record of a job; trying again");
            service.queue.hold(id, &flag);
            if service.wait_for_stop(RETRY) {
                return;
            }
            service.queue.add_again(id, flag);
        }
    }
}

fn attempt(
    service: &Service,
    id: relief_api::JobId,
    flag: &Arc<StopFlag>,
    pulse: &Pulse,
) -> Result<(), crate::error::ServiceError> {
    let mut job = {
        let _order = service.queue.changing();
        let mut job = service.job(id)?;
        job.attempts += 1;
        // Kept before the work begins, which may be the end of this process. One that runs by
        // its record has come to an end that the disk refused to keep.
        if job.state != JobState::Running {
            job.cut_short += 1;
        }
        job.state = JobState::Running;
        job.started_at = Some(now());
        job.ended_at = None;
        service.keep_job(&job)?;
        job
    };
    tracing::info!(job = id, scan = %job.scan, attempt = job.attempts, "job begins");
    let (outcome, timings) = {
        let progress = Progress::new(&service.hub, &job, flag, pulse);
        // A defect in the processing of one scan must not end the service.
        let outcome = catch_unwind(AssertUnwindSafe(|| process(service, &job, &progress)))
            .unwrap_or_else(|panic| JobOutcome::Failed {
                error: format!("the processing ended unexpectedly: {}", panic_text(&*panic)),
                hint: Some(
                    "this is a defect of the program: please report it together with the \
                     scan's journal"
                        .into(),
                ),
            });
        (outcome, progress.finish())
    };
    if !matches!(outcome, JobOutcome::Published { .. }) {
        service.spool.discard(&job.result);
    }
    let _order = service.queue.changing();
    // Before anybody is told: who hears of the end may cancel or retry at once, and must
    // not meet this attempt.
    service.queue.end(id, flag);
    job.timings = timings;
    job.cut_short = 0;
    job.ended_at = Some(now());
    let mut published = None;
    match outcome {
        JobOutcome::Published {
            directory,
            left_out,
        } => {
            job.state = JobState::Done;
            job.error = None;
            job.hint = None;
            job.directory = Some(directory.display().to_string());
            for told in &left_out {
                tracing::warn!(job = id, scan = %job.scan, "{told}");
            }
            job.left_out = left_out;
            tracing::info!(job = id, directory = %directory.display(), "job done");
            published = Some(published_event(service, &job));
            if job.result == job.scan {
                service.forget_grid(&job.scan);
            }
        }
        JobOutcome::Stopped if flag.is_cancelled() => {
            job.state = JobState::Cancelled;
            tracing::info!(job = id, "job cancelled");
        }
        JobOutcome::Stopped => {
            job.state = JobState::Queued;
            job.ended_at = None;
            job.timings.clear();
            tracing::info!(job = id, "job put back, since the service stops");
        }
        JobOutcome::Failed { error, hint } => {
            job.state = JobState::Failed;
            tracing::warn!(job = id, %error, "job failed");
            job.error = Some(error);
            job.hint = hint;
        }
    }
    // Before anybody can see it.
    service.metrics.job_ended(&job);
    if let Some(traces) = service.traces.get() {
        traces.job_ended(&job);
    }
    service.keep_job(&job)?;
    if let Some(event) = published {
        service.hub.tell(event);
    }
    Ok(())
}

fn published_event(service: &Service, job: &Job) -> Event {
    let entry = service.spool.entry(&job.result).ok().flatten();
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
