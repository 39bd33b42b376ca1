//! What every queue is held to, whatever it is made of.
//!
//! A queue's tests make a [`Setting`] for each of [`CASES`] and run it. A case knows nothing of
//! how a queue is made, and waits for what should happen, not for a time.

mod ends;
mod order;
mod workers;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use relief_api::JobState;

use crate::{
    Ending, FORMAT, JobKey, JobQueue, Lease, Need, Order, Outcome, Priority, Standing, Stop, Worker,
};

/// A queue, and what can happen to it.
pub trait Setting {
    /// The queue. After [`Setting::restart`] it may be another one.
    fn queue(&self) -> Arc<dyn JobQueue>;

    /// The key of the n-th job, from 1.
    fn key(&self, n: u64) -> JobKey;

    /// Called before an order is offered, for what the queue must have first.
    fn prepare(&mut self, order: &Order) {
        let _ = order;
    }

    /// The worker dies that has this. What follows need not have happened when this returns, but
    /// happens by itself within [`Setting::patience`].
    fn worker_dies(&mut self, lease: Box<dyn Lease>);

    /// The queue's process is killed, and comes back with what it has kept.
    fn restart(&mut self);

    /// The same queue for a worker that is believed to be dead though it lives, if that can be.
    fn believed_dead(&self) -> Option<Arc<dyn JobQueue>> {
        None
    }

    /// After how long a worker that gives no sign of life loses its order, if it does.
    fn deadline(&self) -> Option<Duration> {
        None
    }

    /// How long something may take that should happen.
    fn patience(&self) -> Duration {
        Duration::from_secs(30)
    }

    /// How long is waited for what should not happen.
    fn glance(&self) -> Duration {
        Duration::from_millis(300)
    }
}

/// Something that a queue is held to.
#[derive(Clone, Copy)]
pub struct Case {
    /// What it is about.
    pub name: &'static str,
    /// Whether it has the queue killed and come back.
    pub restarts: bool,
    /// Fails by a panic.
    pub run: fn(&mut dyn Setting),
}

const fn case(name: &'static str, run: fn(&mut dyn Setting)) -> Case {
    Case {
        name,
        restarts: false,
        run,
    }
}

const fn restarting(name: &'static str, run: fn(&mut dyn Setting)) -> Case {
    Case {
        name,
        restarts: true,
        run,
    }
}

/// All that a queue is held to.
pub const CASES: &[Case] = &[
    case("taken_once_among_many", workers::taken_once_among_many),
    case("priority_then_age", order::priority_then_age),
    case("same_turn_is_one", order::same_turn_is_one),
    case("idle_worker_is_woken", workers::idle_worker_is_woken),
    restarting(
        "done_stays_done_across_restart",
        ends::done_stays_done_across_restart,
    ),
    case("failed_waits_for_a_turn", ends::failed_waits_for_a_turn),
    case("given_back_is_no_attempt", ends::given_back_is_no_attempt),
    case("dead_worker_is_followed", workers::dead_worker_is_followed),
    case("three_deaths_are_enough", workers::three_deaths_are_enough),
    case("cancelled_while_waiting", ends::cancelled_while_waiting),
    case("cancelled_while_running", ends::cancelled_while_running),
    case("cancelled_too_late", ends::cancelled_too_late),
    case("done_though_cancelled", ends::done_though_cancelled),
    case("cancelled_while_taken", ends::cancelled_while_taken),
    case("alive_beyond_deadline", workers::alive_beyond_deadline),
    case("late_settle_counts_once", workers::late_settle_counts_once),
    restarting(
        "waiting_survives_restart_in_order",
        order::waiting_survives_restart_in_order,
    ),
    case("needs_are_respected", workers::needs_are_respected),
    case("formats_are_respected", workers::formats_are_respected),
    case(
        "each_of_many_settled_once",
        workers::each_of_many_settled_once,
    ),
];

/// The n-th order, as most are.
fn order(setting: &dyn Setting, n: u64) -> Order {
    Order {
        format: FORMAT,
        key: setting.key(n),
        turn: 1,
        priority: Priority::Normal,
        need: Need::default(),
        body: serde_json::json!({ "n": n }),
    }
}

fn offer(setting: &mut dyn Setting, order: &Order) {
    setting.prepare(order);
    setting.queue().offer(order).expect("an order is offered");
}

fn worker(name: &str) -> Worker {
    Worker::named(name)
}

/// The next order for a worker; there has to be one.
fn take(setting: &dyn Setting, worker: &Worker) -> Box<dyn Lease> {
    let taken = setting.queue().take(worker, setting.patience());
    taken
        .expect("the queue gives out orders")
        .expect("there is an order")
}

/// No order is there for this worker.
fn nothing_for(setting: &dyn Setting, worker: &Worker) {
    let taken = setting.queue().take(worker, setting.glance());
    let taken = taken.expect("the queue gives out orders");
    assert!(
        taken.is_none(),
        "{} was given {:?}",
        worker.name,
        taken.map(|lease| lease.order().key.clone())
    );
}

fn standing(setting: &dyn Setting, order: &Order) -> Standing {
    let standing = setting.queue().standing(&order.key);
    standing
        .expect("the queue says where orders stand")
        .expect("the order is there")
}

/// Waits until the order stands as it should.
fn wait_for(setting: &dyn Setting, order: &Order, state: JobState) -> Standing {
    let end = Instant::now() + setting.patience();
    loop {
        let found = standing(setting, order);
        if found.state == state {
            return found;
        }
        assert!(Instant::now() < end, "it stays {found:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until the worker is told to stop.
fn wait_for_stop(setting: &dyn Setting, lease: &dyn Lease) -> Stop {
    let end = Instant::now() + setting.patience();
    loop {
        if let Some(stop) = lease.stop() {
            return stop;
        }
        assert!(Instant::now() < end, "the worker is not told to stop");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn done(result: &str) -> Outcome {
    outcome(Ending::Done {
        result: serde_json::json!(result),
        left_out: vec!["view.glb: no room".to_owned()],
    })
}

fn failed(error: &str) -> Outcome {
    outcome(Ending::Failed {
        error: error.to_owned(),
        hint: Some("try again".to_owned()),
    })
}

fn outcome(ending: Ending) -> Outcome {
    Outcome {
        ending,
        timings: vec![relief_api::StageTiming {
            stage: "segment".to_owned(),
            seconds: 0.25,
        }],
    }
}

fn tools(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}
