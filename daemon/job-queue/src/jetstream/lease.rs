//! What a worker has of an order.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use async_nats::jetstream::{AckKind, Message};
use futures_util::StreamExt;
use relief_api::JobState;
use tokio::sync::mpsc;
use tokio::time::MissedTickBehavior;

use super::kept::Kept;
use super::news::Progress;
use super::stores::Stores;
use super::{CALL, Shared, locked};
use crate::order::Order;
use crate::queue::{Ending, Lease, Outcome, QueueError, Standing, Stop};

/// Shares that are done are told so often at most.
const TELL_EVERY: Duration = Duration::from_millis(100);

const GO_ON: u8 = 0;
const CANCELLED: u8 = 1;
const LOST: u8 = 2;

/// An order as it was begun.
#[derive(Debug)]
pub(super) struct Attempt {
    pub(super) order: Order,
    pub(super) begun: Kept,
}

/// What the lease and its task share.
#[derive(Debug)]
struct Held {
    shared: Arc<Shared>,
    stores: Arc<Stores>,
    attempt: Attempt,
    message: Message,
    stop: AtomicU8,
    begun_at: Instant,
    /// When the worker last asked or told, in milliseconds since then.
    asked_ms: AtomicU64,
}

/// What the task tells others.
#[derive(Debug)]
struct Told {
    progress: Progress,
    new_stage: bool,
}

/// A worker's hold on an order. A task of its own gives signs of life to the server, and ends with
/// it.
#[derive(Debug)]
pub(super) struct JetLease {
    held: Arc<Held>,
    told: Mutex<(Option<String>, Option<Instant>)>,
    /// Gone once there is nothing to be told.
    tell: Option<mpsc::UnboundedSender<Told>>,
}

impl JetLease {
    pub(super) fn begin(
        shared: &Arc<Shared>,
        stores: &Arc<Stores>,
        attempt: Attempt,
        message: Message,
    ) -> Self {
        let held = Arc::new(Held {
            shared: Arc::clone(shared),
            stores: Arc::clone(stores),
            attempt,
            message,
            stop: AtomicU8::new(GO_ON),
            begun_at: Instant::now(),
            asked_ms: AtomicU64::new(0),
        });
        let (tell, told) = mpsc::unbounded_channel();
        shared.handle.spawn(Arc::clone(&held).live(told));
        Self {
            held,
            told: Mutex::new((None, None)),
            tell: Some(tell),
        }
    }

    /// Changes the standing, if it is this attempt's still.
    fn end(&self, change: impl Fn(&mut Kept)) -> Result<Standing, QueueError> {
        let held = &self.held;
        let key = &held.attempt.order.key;
        let changed = held.shared.run(CALL, async {
            let stores = held.shared.stores().await?;
            stores
                .change(key, |kept| {
                    if !held.is_mine(kept) || kept.standing.state != JobState::Running {
                        return None;
                    }
                    let mut kept = kept.clone();
                    change(&mut kept);
                    Some(kept)
                })
                .await
        })?;
        match changed {
            Some(kept) if held.is_mine(&kept) || held.is_settled(&kept) => Ok(kept.standing),
            _ => Err(QueueError::Lost(key.clone())),
        }
    }

    /// Tells the server what becomes of the message. Should it not hear, it gives it out again,
    /// and whoever gets it finds by the standing what is to be done.
    fn answer(&self, kind: AckKind) {
        let held = &self.held;
        let answered = held.shared.run(CALL, async {
            let answered = held.message.double_ack_with(kind).await;
            answered.map_err(|error| QueueError::Away(error.to_string()))
        });
        if let Err(error) = answered {
            tracing::debug!(job = %held.attempt.order.key, %error, "a message is not answered");
        }
    }
}

impl Held {
    /// Whether what is kept is about this attempt.
    fn is_mine(&self, kept: &Kept) -> bool {
        kept.standing.turn == self.attempt.order.turn && kept.lease == self.attempt.begun.lease
    }

    /// Whether this turn is settled, whoever did it.
    fn is_settled(&self, kept: &Kept) -> bool {
        kept.standing.turn == self.attempt.order.turn && kept.is_over()
    }

    /// Lives as long as the lease does.
    async fn live(self: Arc<Self>, mut told: mpsc::UnboundedReceiver<Told>) {
        let key = &self.attempt.order.key;
        let wait = self.shared.options.ack_wait;
        let mut beat = tokio::time::interval(wait / 3);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let subject = self.shared.names.cancel(key);
        let mut cancels = self.stores.client.subscribe(subject).await.ok();
        let cancelled = async |cancels: &mut Option<async_nats::Subscriber>| match cancels {
            Some(cancels) => cancels.next().await,
            None => std::future::pending().await,
        };
        loop {
            tokio::select! {
                next = told.recv() => match next {
                    Some(next) => self.pass_on(next).await,
                    None => return,
                },
                _ = beat.tick() => {
                    // Bounded, as a server that does not answer must not keep it from beating.
                    let _ = tokio::time::timeout(wait / 3, self.beat()).await;
                }
                message = cancelled(&mut cancels) => match message {
                    Some(message) => {
                        if message.payload == self.attempt.order.turn.to_string().as_bytes() {
                            self.stop.fetch_max(CANCELLED, Ordering::Relaxed);
                        }
                    }
                    None => cancels = None,
                },
            }
        }
    }

    async fn beat(&self) {
        if !self.shared.link.is_up() || self.stop.load(Ordering::Relaxed) == LOST {
            return;
        }
        let asked = self.begun_at + Duration::from_millis(self.asked_ms.load(Ordering::Relaxed));
        if asked.elapsed() < self.shared.options.silence {
            let _ = self.message.ack_with(AckKind::Progress).await;
        }
        let stop = match self.stores.read(&self.attempt.order.key).await {
            Ok(Some((kept, _))) if self.is_mine(&kept) => match kept.standing.state {
                JobState::Running if kept.cancel => CANCELLED,
                JobState::Running => GO_ON,
                _ => LOST,
            },
            Ok(_) => LOST,
            Err(_) => GO_ON,
        };
        self.stop.fetch_max(stop, Ordering::Relaxed);
    }

    async fn pass_on(&self, told: Told) {
        if !self.shared.link.is_up() {
            return;
        }
        let key = &self.attempt.order.key;
        if let Ok(payload) = serde_json::to_vec(&told.progress) {
            let subject = self.shared.names.progress(key);
            let _ = self.stores.client.publish(subject, payload.into()).await;
        }
        if told.new_stage {
            let kept = self.stores.change(key, |kept| {
                if !self.is_mine(kept) || kept.standing.state != JobState::Running {
                    return None;
                }
                let mut kept = kept.clone();
                kept.standing.stage = Some(told.progress.stage.clone());
                Some(kept)
            });
            let _ = tokio::time::timeout(self.shared.options.ack_wait / 3, kept).await;
        }
    }

    fn asked(&self) {
        let since = u64::try_from(self.begun_at.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.asked_ms.store(since, Ordering::Relaxed);
    }
}

impl Lease for JetLease {
    fn order(&self) -> &Order {
        &self.held.attempt.order
    }

    fn begun(&self) -> &Standing {
        &self.held.attempt.begun.standing
    }

    fn stop(&self) -> Option<Stop> {
        self.held.asked();
        match self.held.stop.load(Ordering::Relaxed) {
            GO_ON => None,
            CANCELLED => Some(Stop::Cancelled),
            _ => Some(Stop::Lost),
        }
    }

    fn tell(&self, stage: &str, fraction: f64, seconds: Option<f64>) {
        self.held.asked();
        let Some(tell) = &self.tell else {
            return;
        };
        let mut last = locked(&self.told);
        let new_stage = last.0.as_deref() != Some(stage);
        let recent = last.1.is_some_and(|at| at.elapsed() < TELL_EVERY);
        if recent && !new_stage && seconds.is_none() {
            return;
        }
        *last = (Some(stage.to_owned()), Some(Instant::now()));
        let progress = Progress {
            stage: stage.to_owned(),
            fraction,
            seconds,
        };
        let _ = tell.send(Told {
            progress,
            new_stage,
        });
    }

    fn settle(&mut self, outcome: &Outcome) -> Result<Standing, QueueError> {
        let standing = self.end(|kept| kept.settle(outcome.clone()))?;
        if !standing.state.is_over() {
            // It was given back.
            return Err(QueueError::Lost(self.held.attempt.order.key.clone()));
        }
        self.tell = None;
        self.held.stop.store(LOST, Ordering::Relaxed);
        self.answer(AckKind::Ack);
        Ok(standing)
    }

    fn give_back(&mut self) -> Result<(), QueueError> {
        let standing = self.end(|kept| {
            if kept.cancel {
                kept.settle_as(Ending::Cancelled);
                return;
            }
            kept.standing.state = JobState::Queued;
            kept.standing.stage = None;
            kept.standing.cut_short = kept.standing.cut_short.saturating_sub(1);
            kept.hands.pop();
        })?;
        self.tell = None;
        self.held.stop.store(LOST, Ordering::Relaxed);
        if standing.state.is_over() {
            self.answer(AckKind::Ack);
            return Ok(());
        }
        self.answer(AckKind::Nak(None));
        let held = &self.held;
        if let Ok(info) = held.message.info() {
            let ring = held.shared.ring(&held.stores, info.consumer);
            let _ = held.shared.run(CALL, async {
                ring.await;
                Ok(())
            });
        }
        Ok(())
    }
}
