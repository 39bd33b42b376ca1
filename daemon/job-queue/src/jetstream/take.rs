//! What a worker does first: takes an order.

use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use async_nats::jetstream::{AckKind, Message};
use futures_util::TryStreamExt;
use relief_api::JobState;

use super::kept::{Kept, TRIES, crowded};
use super::lease::{Attempt, JetLease};
use super::names::Line;
use super::pull::{Pulled, pull};
use super::stores::{Stores, is_there, random_name};
use super::{Shared, locked};
use crate::order::{JobKey, Order};
use crate::queue::{Ending, MOST_CUT_SHORT, QueueError, Worker};

/// For how long the list of lines is believed.
const LINES_AGE: Duration = Duration::from_secs(5);
/// Every so manieth order is looked for from the lowest priority on, so that it goes on there, too.
const LOWEST_EVERY: u64 = 8;
/// A message that was given out so often without an attempt coming of it is what ends its workers
/// before they have begun.
const MOST_DELIVERIES: i64 = 20;
/// When an order is looked at again that a worker of this class cannot do.
const UNFIT_PAUSE: Duration = Duration::from_secs(5);

/// Lines that there are, as far as is known.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    known: Vec<Line>,
    names: HashSet<String>,
    read_at: Option<Instant>,
}

impl Lines {
    /// Has them read anew.
    pub(crate) fn outdate(&mut self) {
        self.read_at = None;
    }

    /// An order was put into the line of this consumer.
    pub(crate) fn heard_of(&mut self, consumer: &str) {
        if !self.names.contains(consumer) {
            self.outdate();
        }
    }

    /// Consumers of the lines that the worker takes orders from.
    fn for_worker(&self, worker: &Worker, lowest_first: bool) -> Option<Vec<String>> {
        self.read_at.filter(|at| at.elapsed() < LINES_AGE)?;
        let fit = self.known.iter().filter(|line| line.fits(worker));
        let mut lines: Vec<_> = fit.collect();
        lines.sort_by_key(|line| line.rank(lowest_first));
        Some(lines.into_iter().map(Line::consumer).collect())
    }
}

/// Waits so long for an order that the worker can do.
pub(super) async fn take(
    shared: &Arc<Shared>,
    worker: &Worker,
    longest: Duration,
) -> Result<Option<JetLease>, QueueError> {
    let end = Instant::now() + longest;
    let mut bell = shared.bell.subscribe();
    loop {
        bell.mark_unchanged();
        let stores = shared.stores().await?;
        for consumer in shared.lines_for(&stores, worker).await? {
            while let Some(message) = fetch(shared, &stores, &consumer).await? {
                if let Some(lease) = begin(shared, &stores, worker, message).await? {
                    shared.given.fetch_add(1, Ordering::Relaxed);
                    return Ok(Some(lease));
                }
            }
        }
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(None);
        }
        tokio::select! {
            _ = bell.changed() => {}
            () = tokio::time::sleep(left.min(shared.options.poll)) => {}
        }
    }
}

impl Shared {
    async fn lines_for(&self, stores: &Stores, worker: &Worker) -> Result<Vec<String>, QueueError> {
        let next = self.given.load(Ordering::Relaxed) + 1;
        let lowest_first = next.is_multiple_of(LOWEST_EVERY);
        if let Some(lines) = locked(&self.lines).for_worker(worker, lowest_first) {
            return Ok(lines);
        }
        // Whatever is heard of from here on has it read once more.
        let read_at = Instant::now();
        locked(&self.lines).read_at = Some(read_at);
        let names: Result<HashSet<String>, _> = stores.orders.consumer_names().try_collect().await;
        let names = match names {
            Ok(names) => names,
            Err(error) => {
                self.doubt_stores().await;
                return Err(QueueError::Away(format!("the orders' consumers: {error}")));
            }
        };
        let mut lines = locked(&self.lines);
        lines.known = names.iter().filter_map(|name| Line::parse(name)).collect();
        lines.names = names;
        let outdated = lines.read_at != Some(read_at);
        lines.read_at = Some(read_at);
        let found = lines.for_worker(worker, lowest_first);
        if outdated {
            lines.outdate();
        }
        Ok(found.unwrap_or_default())
    }
}

/// The next message of a line, if it has one.
async fn fetch(
    shared: &Shared,
    stores: &Stores,
    consumer: &str,
) -> Result<Option<Message>, QueueError> {
    match pull(stores, consumer).await? {
        Pulled::Message(message) => Ok(Some(*message)),
        Pulled::Nothing => Ok(None),
        Pulled::Gone(why) => {
            tracing::debug!(%why, consumer, "lines of orders are read anew");
            locked(&shared.lines).outdate();
            Ok(None)
        }
    }
}

/// What is to be done with a message.
enum Verdict {
    /// It speaks for nothing.
    Drop,
    /// It was given out again since then.
    Leave,
    /// This worker cannot do it.
    Unfit,
    /// It is settled without being worked on.
    Settle(Kept),
    /// It is begun.
    Begin(Kept),
}

/// Begins what a message is about, if that can be.
async fn begin(
    shared: &Arc<Shared>,
    stores: &Arc<Stores>,
    worker: &Worker,
    message: Message,
) -> Result<Option<JetLease>, QueueError> {
    let Some((key, turn)) = shared.names.parse_order(&message.subject) else {
        tracing::warn!(subject = %message.subject, "an order of nobody is dropped");
        return answer(&message, AckKind::Term).await.map(|()| None);
    };
    let order = read_order(&message, &key, turn);
    for _ in 0..TRIES {
        let Some((kept, revision)) = stores.read(&key).await? else {
            return answer(&message, AckKind::Ack).await.map(|()| None);
        };
        let verdict = judge(stores, worker, &kept, turn, order.as_ref(), &message).await?;
        match (verdict, &order) {
            (Verdict::Leave, _) => return Ok(None),
            (Verdict::Unfit, _) => {
                answer(&message, AckKind::Nak(Some(UNFIT_PAUSE))).await?;
                return Ok(None);
            }
            (Verdict::Settle(settled), _) => {
                if stores.write(&key, &settled, Some(revision)).await? {
                    tracing::error!(job = %key, "an order is set aside");
                    return answer(&message, AckKind::Ack).await.map(|()| None);
                }
            }
            (Verdict::Begin(begun), Ok(order)) => {
                if stores.write(&key, &begun, Some(revision)).await? {
                    let attempt = Attempt {
                        order: order.clone(),
                        begun,
                    };
                    return Ok(Some(JetLease::begin(shared, stores, attempt, message)));
                }
            }
            (Verdict::Drop | Verdict::Begin(_), _) => {
                return answer(&message, AckKind::Ack).await.map(|()| None);
            }
        }
    }
    Err(crowded(&key))
}

async fn judge(
    stores: &Stores,
    worker: &Worker,
    kept: &Kept,
    turn: u32,
    order: Result<&Order, &String>,
    message: &Message,
) -> Result<Verdict, QueueError> {
    if kept.standing.turn != turn || kept.is_over() {
        return Ok(Verdict::Drop);
    }
    let (sequence, delivery) = match message.info() {
        Ok(info) => (info.stream_sequence, info.delivered),
        Err(error) => return Err(QueueError::Away(format!("an order's message: {error}"))),
    };
    if let Some(taken) = kept.message {
        if taken == sequence && kept.delivery >= delivery {
            return Ok(Verdict::Leave);
        }
        let runs = kept.standing.state == JobState::Running;
        if taken != sequence && runs && is_there(&stores.orders, taken).await? {
            return Ok(Verdict::Drop);
        }
    }
    let mut next = kept.clone();
    if kept.cancel {
        next.settle_as(Ending::Cancelled);
        return Ok(Verdict::Settle(next));
    }
    let order = match order {
        Ok(order) => order,
        Err(why) => {
            next.settle_as(Ending::Failed {
                error: format!("the order cannot be read: {why}"),
                hint: Some("retry it; if that fails, too, please report this".to_owned()),
            });
            return Ok(Verdict::Settle(next));
        }
    };
    if let Some(ending) = given_up(kept, delivery) {
        next.settle_as(ending);
        return Ok(Verdict::Settle(next));
    }
    if !worker.can(order) {
        return Ok(Verdict::Unfit);
    }
    next.standing.state = JobState::Running;
    next.standing.attempts = next.standing.attempts.saturating_add(1);
    next.standing.cut_short += 1;
    next.standing.worker = Some(worker.name.clone());
    next.standing.stage = None;
    next.message = Some(sequence);
    next.delivery = delivery;
    next.lease = Some(random_name());
    next.hands.push(worker.name.clone());
    Ok(Verdict::Begin(next))
}

/// Whether an order is given to nobody any more, as it may be what ends its workers.
fn given_up(kept: &Kept, delivery: i64) -> Option<Ending> {
    let hint = "look in their logs for why they ended: if they ran out of memory, rerun the scan \
                with a larger regrid.pitch_mm; if they were stopped or lost their network, retry \
                the job";
    let error = if kept.standing.cut_short >= MOST_CUT_SHORT {
        format!(
            "{} workers in a row ({}) ended in the midst of this job, which may be the cause",
            kept.standing.cut_short,
            kept.hands.join(", ")
        )
    } else if delivery - i64::from(kept.standing.attempts) > MOST_DELIVERIES {
        format!(
            "the order was given out {delivery} times and begun {} times: workers end before they \
             begin it",
            kept.standing.attempts
        )
    } else {
        return None;
    };
    Some(Ending::Failed {
        error,
        hint: Some(hint.to_owned()),
    })
}

fn read_order(message: &Message, key: &JobKey, turn: u32) -> Result<Order, String> {
    let order: Order =
        serde_json::from_slice(&message.payload).map_err(|error| error.to_string())?;
    if order.key == *key && order.turn == turn {
        Ok(order)
    } else {
        Err(format!("it is one of job {}", order.key))
    }
}

async fn answer(message: &Message, kind: AckKind) -> Result<(), QueueError> {
    let sent = message.ack_with(kind).await;
    sent.map_err(|error| QueueError::Away(format!("an order's message: {error}")))
}
