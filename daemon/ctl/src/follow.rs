//! Follows a scan and its job until the deliverables are there, showing how far they are.

use std::time::{Duration, Instant};

use relief_api::{Event, Job, JobId, JobState, Scan, ScanState, path};
use tokio::time::{MissedTickBehavior, interval};

use crate::failure::Failure;
use crate::progress::Progress;
use crate::service::{Client, Events};

/// How often the service is asked in any case: events may be lost, states are not.
const ASK_EVERY: Duration = Duration::from_secs(1);

/// What came of a scan.
pub(crate) struct Followed {
    /// The complete scan.
    pub(crate) scan: Scan,
    /// The job whose deliverables are published.
    pub(crate) job: Job,
    /// From the last column's being on disk to publication, seconds, as seen from here.
    pub(crate) after_last_column_s: f64,
}

/// Follows a scan until its job has published.
///
/// # Errors
/// When the scan does not complete or the job does not succeed, and why.
pub(crate) async fn scan(
    client: &Client,
    mut events: Events,
    id: &str,
) -> Result<Followed, Failure> {
    let mut bar = Progress::counted("scan", 0, "columns");
    let mut asking = asking();
    let mut last_column = Instant::now();
    let mut told: Option<String> = None;
    let scan = loop {
        let state = tokio::select! {
            event = events.next() => match event? {
                Some(Event::Column { scan, columns, columns_planned, .. }) if scan == id => {
                    last_column = Instant::now();
                    bar.count(columns.into(), columns_planned.into(), "");
                    None
                }
                Some(Event::Scan(scan)) if scan.id == id => Some(scan),
                Some(_) => None,
                None => return Err(ended()),
            },
            _ = asking.tick() => Some(client.get::<Scan>(&path::scan(id)).await?),
        };
        // A scan is whole for us once its job is known, too.
        match state {
            Some(scan) if scan.state == ScanState::Complete && scan.jobs.is_empty() => {}
            Some(scan) if scan.state.is_over() => break scan,
            Some(scan) => {
                // Said once for each pause: the service repeats it with every answer.
                let pause = scan.reason.filter(|_| scan.state == ScanState::Paused);
                if let Some(reason) = pause.as_ref().filter(|_| pause != told) {
                    bar.note(&format!("paused: {reason}"));
                }
                told = pause;
            }
            None => {}
        }
    };
    if scan.state != ScanState::Complete {
        bar.abandon(scan.state.as_str());
        return Err(Failure::Failed(format!(
            "scan {} {} after {} of {} columns{}",
            scan.id,
            match scan.state {
                ScanState::Aborted => "was aborted",
                ScanState::Interrupted => "was interrupted",
                _ => "failed",
            },
            scan.columns,
            scan.columns_planned,
            scan.reason
                .as_ref()
                .map_or(String::new(), |reason| format!(": {reason}"))
        )));
    }
    bar.count(scan.columns.into(), scan.columns_planned.into(), "");
    bar.finish(&format!("{} columns on disk", scan.columns));
    let first = scan.jobs.first().copied().unwrap_or_default();
    let job = job(client, events, first).await?;
    Ok(Followed {
        scan,
        job,
        after_last_column_s: last_column.elapsed().as_secs_f64(),
    })
}

/// Follows a job until it has published.
///
/// # Errors
/// When the job fails or is cancelled, and why.
pub(crate) async fn job(client: &Client, mut events: Events, id: JobId) -> Result<Job, Failure> {
    let mut bar = Progress::share("job");
    let mut asking = asking();
    let job = loop {
        let state = tokio::select! {
            event = events.next() => match event? {
                Some(Event::Progress { job, stage, fraction, .. }) if job == id => {
                    bar.at(fraction, &stage);
                    None
                }
                Some(Event::Job(job)) if job.id == id => Some(job),
                Some(_) => None,
                None => return Err(ended()),
            },
            _ = asking.tick() => Some(client.get::<Job>(&path::job(id)).await?),
        };
        match state {
            Some(job) if job.state.is_over() => break job,
            Some(Job {
                state: JobState::Queued,
                ..
            }) => bar.at(0.0, "queued"),
            _ => {}
        }
    };
    if job.state == JobState::Done {
        let seconds: f64 = job.timings.iter().map(|timing| timing.seconds).sum();
        bar.at(1.0, "");
        bar.finish(&format!("published in {seconds:.2} s"));
        for told in &job.left_out {
            eprintln!("relief: note: {told}");
        }
        return Ok(job);
    }
    bar.abandon(job.state.as_str());
    let mut message = format!(
        "job {} of scan {} {}",
        job.id,
        job.scan,
        match job.state {
            JobState::Cancelled => "was cancelled",
            _ => "failed",
        }
    );
    for text in [&job.error, &job.hint].into_iter().flatten() {
        message.push_str(": ");
        message.push_str(text);
    }
    Err(Failure::Failed(message))
}

fn asking() -> tokio::time::Interval {
    let mut asking = interval(ASK_EVERY);
    asking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    asking
}

fn ended() -> Failure {
    Failure::Failed(
        "the service ended while we waited; what it kept is there when it is back".into(),
    )
}
