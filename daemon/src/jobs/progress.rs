//! Telling how far an attempt is, stage by stage.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use job_queue::Lease;
use pipeline::{Observer, Stage};
use range_image::Monitor;
use relief_api::StageTiming;

use crate::liveness::Pulse;
use crate::service::lock;

/// Progress is told in steps of this share of a stage.
const STEP: f64 = 0.02;

/// Watches over one attempt at a job.
pub(crate) struct Progress<'a> {
    lease: &'a dyn Lease,
    pulse: &'a Pulse,
    is_to_stop: &'a (dyn Fn(Duration) -> bool + Sync),
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    running: Option<Running>,
    finished: Vec<StageTiming>,
}

struct Running {
    stage: String,
    since: Instant,
    told: f64,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(
        lease: &'a dyn Lease,
        pulse: &'a Pulse,
        is_to_stop: &'a (dyn Fn(Duration) -> bool + Sync),
    ) -> Self {
        Self {
            lease,
            pulse,
            is_to_stop,
            state: Mutex::default(),
        }
    }

    /// A stage begins that the pipeline does not know, such as the publication.
    pub(crate) fn begin(&self, stage: &str) {
        let mut state = lock(&self.state);
        self.close(&mut state);
        state.running = Some(Running {
            stage: stage.to_owned(),
            since: Instant::now(),
            told: 0.0,
        });
        self.lease.tell(stage, 0.0, None);
    }

    /// Ends the stage under way; gives all stages and how long they took.
    pub(crate) fn finish(&self) -> Vec<StageTiming> {
        let mut state = lock(&self.state);
        self.close(&mut state);
        state.finished.clone()
    }

    fn close(&self, state: &mut State) {
        if let Some(running) = state.running.take() {
            let seconds = running.since.elapsed().as_secs_f64();
            self.lease.tell(&running.stage, 1.0, Some(seconds));
            state.finished.push(StageTiming {
                stage: running.stage,
                seconds,
            });
        }
    }
}

impl Monitor for Progress<'_> {
    fn is_cancelled(&self) -> bool {
        self.pulse.beat();
        self.lease.stop().is_some() || (self.is_to_stop)(Duration::ZERO)
    }

    fn progress(&self, fraction: f64) {
        self.pulse.beat();
        let mut state = lock(&self.state);
        if let Some(running) = &mut state.running
            && fraction >= running.told + STEP
            && fraction < 1.0
        {
            running.told = fraction;
            let stage = running.stage.clone();
            drop(state);
            self.lease.tell(&stage, fraction, None);
        }
    }
}

impl Observer for Progress<'_> {
    fn stage(&self, stage: Stage) {
        self.begin(stage.as_str());
    }
}
