//! One job that is worked on elsewhere, from the bench's side: handed over, followed, and its
//! result fetched into the spool.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use job_queue::{Ending, JobQueue, Order, Outcome, QueueError, Standing, Stop};
use relief_api::{Job, JobId, JobState};
use serde_json::Value;

use super::Fleet;
use super::fetch::FetchError;
use super::order::Answer;
use crate::error::ServiceError;
use crate::jobs::StopFlag;
use crate::service::{Service, lock};

/// How long it waits for news before it looks by itself.
const LOOK: Duration = Duration::from_secs(1);
/// How long news of an order may be on their way that was just offered.
const SOON: Duration = Duration::from_millis(200);
/// How long what does not work is left alone.
const PAUSE: Duration = Duration::from_secs(2);
/// How often it looks for a result before it takes it for damaged: a server that has just begun to
/// lead may not know yet what it has.
const LOOKS: u32 = 4;
/// What is damaged or missing on its way is asked for again so often: after a moment, and each time
/// after twice as long, since servers that have just lost one of theirs may know better soon.
const MOST_DAMAGED: u32 = 5;
/// The longest of these moments, which are so many in the silence that a worker is allowed.
const MOMENT: Duration = Duration::from_secs(1);
const MOMENTS: u32 = 30;
/// What was not heard of for so many times the silence that a worker is allowed is offered once
/// more: its message may be lost, as of a server that was killed.
const DOUBT: u32 = 2;
/// What runs elsewhere is left to run for so many times as long as what waits, when the servers are
/// away.
const LONGER: u32 = 20;

/// Why a job is not followed any longer.
enum Left {
    /// The service stops; the next start goes on.
    ServiceStops,
    /// Nobody wants it any more.
    Cancelled,
    /// The servers are away, and it is done here.
    DoneHere,
    /// It is over, and what became of it is kept.
    Over {
        /// Nothing of it is left elsewhere.
        is_cleared: bool,
    },
    /// It has to be offered anew.
    Anew,
}

/// Follows one job.
pub(super) struct HandOver {
    pub(super) service: Arc<Service>,
    pub(super) fleet: Arc<Fleet>,
    /// As it was taken out of the service's own queue.
    pub(super) taken: Order,
    pub(super) flag: Arc<StopFlag>,
}

impl HandOver {
    fn id(&self) -> JobId {
        self.taken.key.job
    }

    fn moment(&self) -> Duration {
        MOMENT.min(self.fleet.config.silence() / MOMENTS)
    }

    /// Sees the job to its end, or to where somebody else goes on; tells whether something of it may
    /// be left elsewhere.
    pub(super) fn see_through(&self) -> bool {
        let id = self.id();
        let mut damaged = 0;
        let left = loop {
            match self.once(&mut damaged) {
                Ok(Left::Anew) => {}
                Ok(left) => break left,
                Err(error) => {
                    tracing::error!(job = id, %error, "cannot keep the record of a job; trying again");
                    if self.service.wait_for_stop(PAUSE) {
                        break Left::ServiceStops;
                    }
                }
            }
        };
        let queue = &self.service.queue;
        match left {
            Left::DoneHere => {
                tracing::info!(job = id, "the NATS servers are away: a job is done here");
                let let_go = || queue.end(id, &self.flag);
                if let Err(error) = self.service.put_back_job(id, let_go) {
                    // Its record is as it was, which is as good.
                    tracing::warn!(job = id, %error, "cannot keep the record of a job");
                    queue.end(id, &self.flag);
                    queue.add(self.taken.clone());
                }
            }
            Left::Cancelled => self.end_here(&Ending::Cancelled),
            Left::ServiceStops | Left::Over { .. } | Left::Anew => queue.end(id, &self.flag),
        }
        !matches!(left, Left::ServiceStops | Left::Over { is_cleared: true })
    }

    /// Ends a job about which nobody elsewhere is to be asked.
    fn end_here(&self, ending: &Ending) {
        let outcome = Outcome {
            ending: ending.clone(),
            timings: Vec::new(),
        };
        while let Err(error) = self.keep_end(&outcome) {
            tracing::error!(job = self.id(), %error, "cannot keep the record of a job; trying again");
            if self.service.wait_for_stop(PAUSE) {
                break;
            }
        }
        self.service.queue.end(self.id(), &self.flag);
    }

    fn keep_end(&self, outcome: &Outcome) -> Result<Job, ServiceError> {
        let let_go = || self.service.queue.end(self.id(), &self.flag);
        self.service.end_job(self.id(), outcome, let_go)
    }

    /// Whether somebody wants it left.
    fn is_left(&self, runs: bool) -> Option<Left> {
        match self.flag.why() {
            Some(Stop::WorkerEnds | Stop::Lost) => return Some(Left::ServiceStops),
            Some(Stop::Cancelled) => return Some(Left::Cancelled),
            None => {}
        }
        let longest = self.fleet.away_limit()? * if runs { LONGER } else { 1 };
        let is_away = !self.fleet.queue.is_connected() && self.fleet.away_for() >= longest;
        is_away.then_some(Left::DoneHere)
    }

    /// Hands it over, and follows it from there.
    fn once(&self, damaged: &mut u32) -> Result<Left, ServiceError> {
        let job = self.service.job(self.id())?;
        // Of an earlier start of the service, or its end could not be kept.
        if let Some(directory) = self.service.spool.published(&job.result)? {
            let left_out = job.left_out.clone();
            self.keep_end(&published(&directory, left_out, job.timings))?;
            return Ok(Left::Over { is_cleared: false });
        }
        let order = match self.offer(&job, *damaged > 0)? {
            Ok(order) => order,
            Err(left) => return Ok(left),
        };
        self.follow(&job, &order, damaged)
    }

    /// Offers the job, for as long as it takes.
    fn offer(&self, job: &Job, is_missed: bool) -> Result<Result<Order, Left>, ServiceError> {
        let fleet = &self.fleet;
        loop {
            if let Some(left) = self.is_left(false) {
                return Ok(Err(left));
            }
            if !fleet.queue.is_connected() {
                fleet.board.pause(LOOK);
                continue;
            }
            let scan = self.service.scan(&job.scan)?;
            let offered = fleet
                .share_whole(&self.service, job.id, &job.scan, is_missed)
                .and_then(|journal| fleet.order_of(job, scan, journal))
                .and_then(|order| {
                    self.withdraw_later(&order)?;
                    fleet.queue.offer(&order)?;
                    Ok(order)
                });
            match offered {
                Ok(order) => {
                    fleet.trouble(None);
                    self.service.queue.waits_elsewhere(job.id, true);
                    return Ok(Ok(order));
                }
                // The columns themselves cannot be read.
                Err(QueueError::Records(error)) => {
                    self.end_here(&Ending::Failed { error, hint: None });
                    return Ok(Err(Left::Over { is_cleared: false }));
                }
                Err(error) => {
                    fleet.trouble(Some(&error));
                    self.service.wait_for_stop(PAUSE);
                }
            }
        }
    }

    /// An order that stands there with a later turn is of a time when this machine's clock was ahead.
    fn withdraw_later(&self, order: &Order) -> Result<(), QueueError> {
        let queue = &self.fleet.queue;
        match queue.standing(&order.key)? {
            Some(standing) if standing.turn > order.turn => queue.forget(&order.key),
            _ => Ok(()),
        }
    }

    /// Offers it once more where nobody was heard of since then for long; gives from when on that
    /// counts.
    fn offer_in_doubt(&self, order: &Order, since: Instant) -> Instant {
        let fleet = &self.fleet;
        let told = lock(&fleet.handed).get(&self.id()).and_then(|h| h.heard);
        let heard = told.map_or(since, |told| told.max(since));
        if heard.elapsed() < fleet.config.silence() * DOUBT || !fleet.queue.is_connected() {
            return heard;
        }
        if let Err(error) = fleet.queue.offer(order) {
            tracing::debug!(job = self.id(), %error, "an order is looked for later");
        }
        Instant::now()
    }

    /// Follows it until it is over.
    fn follow(&self, job: &Job, order: &Order, damaged: &mut u32) -> Result<Left, ServiceError> {
        let fleet = &self.fleet;
        let mut known: Option<Standing> = None;
        let mut begun = 0;
        let mut is_asked_to_stop = false;
        let mut heard = Instant::now();
        loop {
            heard = self.offer_in_doubt(order, heard);
            let is_its = |s: &Standing| s.turn == order.turn && s.state == JobState::Running;
            let runs = known.as_ref().is_some_and(is_its);
            match self.is_left(runs) {
                Some(Left::Cancelled) if fleet.queue.is_connected() => {
                    is_asked_to_stop = is_asked_to_stop || fleet.queue.cancel(&order.key).is_ok();
                }
                Some(left) => return Ok(left),
                None => {}
            }
            fleet.board.wait(job.id, known.as_ref(), LOOK);
            let told = match fleet.board.standing(job.id) {
                Some(told) => told,
                // The server may have lost it, or has not told it yet.
                None if fleet.board.pauses(job.id, SOON) => continue,
                None => match fleet.queue.standing(&order.key) {
                    Ok(Some(told)) => told,
                    Ok(None) => return Ok(Left::Anew),
                    Err(_) => continue,
                },
            };
            if known.as_ref() != Some(&told) {
                heard = Instant::now();
            }
            if told.turn != order.turn {
                // What is told is of an earlier turn; this one is on its way.
                known = Some(told);
                continue;
            }
            match told.state {
                // Both may come at once.
                _ if told.attempts > begun && told.state != JobState::Queued => {
                    begun = told.attempts;
                    let worker = told.worker.as_deref().unwrap_or("?");
                    tracing::info!(job = job.id, scan = %job.scan, worker, "a job is worked on elsewhere");
                    self.service.note_elsewhere(job.id, Some(worker))?;
                }
                JobState::Queued if runs => {
                    self.service.note_elsewhere(job.id, None)?;
                }
                _ => {}
            }
            if let Some(outcome) = &told.outcome {
                return self.take_home(job, order, outcome, damaged);
            }
            known = Some(told);
        }
    }

    /// Keeps what became of it.
    fn take_home(
        &self,
        job: &Job,
        order: &Order,
        outcome: &Outcome,
        damaged: &mut u32,
    ) -> Result<Left, ServiceError> {
        let fleet = &self.fleet;
        let (result, left_out) = match &outcome.ending {
            Ending::Done { result, left_out } => (result, left_out),
            Ending::Failed { .. } | Ending::Cancelled => {
                self.keep_end(outcome)?;
                let is_cleared = fleet.clear(order, None);
                return Ok(Left::Over { is_cleared });
            }
        };
        let told = |error: &dyn std::fmt::Display| format!("what a worker has made: {error}");
        let delivered = match serde_json::from_value(result.clone()) {
            Ok(Answer::Delivered(delivered)) => Ok(delivered),
            Ok(Answer::Missing(what)) => Err(format!("a worker has not found the columns: {what}")),
            Err(error) => Err(told(&error)),
        };
        let mut looks = 1;
        let fetched = match &delivered {
            Ok(delivered) => loop {
                if let Some(left) = self.is_left(true) {
                    return Ok(left);
                }
                match fleet.fetch(&self.service, job, delivered) {
                    Err(FetchError::Queue(QueueError::Away(_))) => fleet.board.pause(LOOK),
                    Err(FetchError::Queue(QueueError::Damaged { .. })) if looks < LOOKS => {
                        looks += 1;
                        self.service.wait_for_stop(self.moment());
                    }
                    // As of a result that was made here; making it once more would not help.
                    Err(FetchError::Spool { error, hint }) => {
                        let hint = Some(hint);
                        self.end_here(&Ending::Failed { error, hint });
                        let is_cleared = fleet.clear(order, Some(delivered));
                        return Ok(Left::Over { is_cleared });
                    }
                    Err(FetchError::Queue(error)) => break Err(told(&error)),
                    Ok(directory) => break Ok(directory),
                }
            },
            Err(error) => Err(error.clone()),
        };
        match fetched {
            Ok(directory) => {
                let timings = outcome.timings.clone();
                self.keep_end(&published(&directory, left_out.clone(), timings))?;
                let is_cleared = fleet.clear(order, delivered.ok().as_ref());
                Ok(Left::Over { is_cleared })
            }
            Err(error) if *damaged < MOST_DAMAGED => {
                *damaged += 1;
                tracing::warn!(job = job.id, scan = %job.scan, %error, "a job is handed over anew");
                self.service.note_elsewhere(job.id, None)?;
                self.service.turn_job(job.id)?;
                fleet.clear(order, delivered.ok().as_ref());
                let pause = self.moment() * 2_u32.pow(*damaged - 1);
                self.service.wait_for_stop(pause);
                Ok(Left::Anew)
            }
            Err(error) => {
                let hint = "see in the logs of the NATS servers and of the workers what damages \
                            results, then retry the job";
                self.end_here(&Ending::Failed {
                    error,
                    hint: Some(hint.to_owned()),
                });
                let is_cleared = fleet.clear(order, delivered.ok().as_ref());
                Ok(Left::Over { is_cleared })
            }
        }
    }
}

/// A result in its place.
fn published(
    directory: &Path,
    left_out: Vec<String>,
    timings: Vec<relief_api::StageTiming>,
) -> Outcome {
    Outcome {
        ending: Ending::Done {
            result: Value::String(directory.display().to_string()),
            left_out,
        },
        timings,
    }
}
