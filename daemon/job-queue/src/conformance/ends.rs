//! How orders end.

use std::sync::Barrier;
use std::thread;
use std::time::Duration;

use relief_api::JobState;

use super::{
    Setting, done, failed, nothing_for, offer, order, outcome, standing, take, wait_for,
    wait_for_stop, worker,
};
use crate::{Ending, Stop};

pub(super) fn done_stays_done_across_restart(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let outcome = done("where it is");
    let settled = take(setting, &worker("w")).settle(&outcome);
    let settled = settled.expect("it is settled");
    assert_eq!(settled.state, JobState::Done);
    assert_eq!(settled.outcome.as_ref(), Some(&outcome));
    assert_eq!(settled.cut_short, 0, "it came to an end");
    assert_eq!(standing(setting, &order), settled);
    setting.restart();
    assert_eq!(standing(setting, &order), settled);
    nothing_for(setting, &worker("w"));
    setting.queue().offer(&order).expect("it may be repeated");
    nothing_for(setting, &worker("w"));
    assert_eq!(standing(setting, &order), settled);
}

pub(super) fn failed_waits_for_a_turn(setting: &mut dyn Setting) {
    let mut order = order(setting, 1);
    offer(setting, &order);
    let outcome = failed("no plane fits");
    let settled = take(setting, &worker("w")).settle(&outcome);
    assert_eq!(settled.expect("it is settled").state, JobState::Failed);
    nothing_for(setting, &worker("w"));
    assert_eq!(standing(setting, &order).outcome, Some(outcome));
    order.turn = 2;
    offer(setting, &order);
    let mut lease = take(setting, &worker("w"));
    assert_eq!(lease.order().turn, 2);
    assert_eq!(lease.begun().turn, 2);
    assert_eq!(lease.begun().cut_short, 1, "a new turn begins anew");
    assert_eq!(lease.begun().outcome, None);
    lease.settle(&done("r")).expect("it is settled");
    assert_eq!(standing(setting, &order).state, JobState::Done);
    nothing_for(setting, &worker("w"));
}

pub(super) fn given_back_is_no_attempt(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    // More often than a worker may die with it.
    for attempt in 1..=5 {
        let mut lease = take(setting, &worker("w"));
        assert_eq!(lease.begun().attempts, attempt);
        assert_eq!(lease.begun().cut_short, 1);
        lease.give_back().expect("it is given back");
        let standing = standing(setting, &order);
        assert_eq!(standing.state, JobState::Queued);
        assert_eq!(standing.cut_short, 0);
    }
    let settled = take(setting, &worker("v")).settle(&done("r"));
    let settled = settled.expect("it is settled");
    // A queue need not keep who it was.
    assert!(settled.worker.is_none_or(|worker| worker == "v"));
}

pub(super) fn cancelled_while_waiting(setting: &mut dyn Setting) {
    let (first, second) = (order(setting, 1), order(setting, 2));
    offer(setting, &first);
    offer(setting, &second);
    setting.queue().cancel(&first.key).expect("it is cancelled");
    let gone = standing(setting, &first);
    assert_eq!(gone.state, JobState::Cancelled);
    let ending = gone.outcome.map(|outcome| outcome.ending);
    assert_eq!(ending, Some(Ending::Cancelled));
    let mut lease = take(setting, &worker("w"));
    assert_eq!(lease.order().key, second.key, "only the other one is left");
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &worker("w"));
}

pub(super) fn cancelled_while_running(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let mut lease = take(setting, &worker("w"));
    assert_eq!(lease.stop(), None);
    setting.queue().cancel(&order.key).expect("it is cancelled");
    assert_eq!(wait_for_stop(setting, &*lease), Stop::Cancelled);
    let settled = lease.settle(&outcome(Ending::Cancelled));
    assert_eq!(settled.expect("it is settled").state, JobState::Cancelled);
    assert_eq!(standing(setting, &order).state, JobState::Cancelled);
    nothing_for(setting, &worker("w"));
}

pub(super) fn cancelled_too_late(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let settled = take(setting, &worker("w")).settle(&done("r"));
    let settled = settled.expect("it is settled");
    setting.queue().cancel(&order.key).expect("nothing is done");
    assert_eq!(standing(setting, &order), settled);
    let unknown = setting.key(9);
    setting.queue().cancel(&unknown).expect("nothing is done");
    let found = setting.queue().standing(&unknown).expect("it is looked up");
    assert_eq!(found, None);
}

/// A worker may have done it before it hears that it is wanted no more. Whatever counts, it is the
/// same for the worker and the bench.
pub(super) fn done_though_cancelled(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let mut lease = take(setting, &worker("w"));
    setting.queue().cancel(&order.key).expect("it is cancelled");
    let settled = lease.settle(&done("r")).expect("it is settled");
    assert!(matches!(
        settled.state,
        JobState::Done | JobState::Cancelled
    ));
    assert_eq!(wait_for(setting, &order, settled.state), settled);
    nothing_for(setting, &worker("w"));
}

/// Of two that change an order at the same time, one is first, and the other sees it.
pub(super) fn cancelled_while_taken(setting: &mut dyn Setting) {
    let (queue, glance) = (setting.queue(), setting.glance());
    let mut taken_first = 0;
    for n in 1..=12 {
        let order = order(setting, n);
        offer(setting, &order);
        let together = Barrier::new(2);
        let taken = thread::scope(|scope| {
            let takes = scope.spawn(|| {
                together.wait();
                queue.take(&worker("w"), Duration::ZERO)
            });
            together.wait();
            queue.cancel(&order.key).expect("it is cancelled");
            takes.join().expect("no panic").expect("it is looked for")
        });
        if let Some(mut lease) = taken {
            taken_first += 1;
            assert_eq!(wait_for_stop(setting, &*lease), Stop::Cancelled);
            let settled = lease.settle(&outcome(Ending::Cancelled));
            settled.expect("it is settled");
        }
        assert_eq!(standing(setting, &order).state, JobState::Cancelled);
    }
    let taken = queue.take(&worker("w"), glance).expect("it is looked for");
    assert!(
        taken.is_none(),
        "{taken_first} of 12 were taken, and one more"
    );
}
