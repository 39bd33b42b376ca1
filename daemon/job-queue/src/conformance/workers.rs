//! Workers that are many, that die, that cannot do everything.

use std::collections::BTreeMap;
use std::sync::{Barrier, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use relief_api::JobState;

use super::{
    Setting, done, failed, nothing_for, offer, order, standing, take, tools, wait_for,
    wait_for_stop, worker,
};
use crate::{Ending, FORMAT, MOST_CUT_SHORT, QueueError, Stop};

pub(super) fn taken_once_among_many(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let (queue, glance) = (setting.queue(), setting.glance());
    let together = Barrier::new(8);
    let leases = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for n in 0..8 {
            let (queue, together, leases) = (&queue, &together, &leases);
            scope.spawn(move || {
                together.wait();
                let taken = queue.take(&worker(&format!("w{n}")), glance);
                let taken = taken.expect("the queue gives out orders");
                leases.lock().expect("no thread panicked").extend(taken);
            });
        }
    });
    let mut leases = leases.into_inner().expect("no thread panicked");
    assert_eq!(leases.len(), 1);
    let settled = leases.remove(0).settle(&done("r"));
    assert_eq!(settled.expect("it is settled").attempts, 1);
}

pub(super) fn idle_worker_is_woken(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    setting.prepare(&order);
    let (queue, patience) = (setting.queue(), setting.patience());
    thread::scope(|scope| {
        let waits = scope.spawn(|| queue.take(&worker("w"), patience));
        thread::sleep(Duration::from_millis(50));
        queue.offer(&order).expect("an order is offered");
        let taken = waits.join().expect("no panic").expect("it is given out");
        let mut lease = taken.expect("there is an order");
        lease.settle(&done("r")).expect("it is settled");
    });
}

pub(super) fn dead_worker_is_followed(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    let lease = take(setting, &worker("first"));
    assert_eq!(lease.begun().attempts, 1);
    assert_eq!(lease.begun().cut_short, 1);
    setting.worker_dies(lease);
    let mut lease = take(setting, &worker("second"));
    let begun = lease.begun();
    assert_eq!((begun.attempts, begun.cut_short), (2, 2));
    assert!(
        begun
            .worker
            .as_deref()
            .is_none_or(|worker| worker == "second")
    );
    let settled = lease.settle(&done("r")).expect("it is settled");
    assert_eq!((settled.attempts, settled.cut_short), (2, 0));
    nothing_for(setting, &worker("w"));
}

pub(super) fn three_deaths_are_enough(setting: &mut dyn Setting) {
    let bad = order(setting, 1);
    offer(setting, &bad);
    for n in 1..=MOST_CUT_SHORT {
        let lease = take(setting, &worker(&format!("victim-{n}")));
        assert_eq!(lease.begun().cut_short, n);
        setting.worker_dies(lease);
    }
    // A worker that looks for an order is what finds out; it is given the next one.
    let good = order(setting, 2);
    let end = Instant::now() + setting.patience();
    while standing(setting, &bad).state != JobState::Failed {
        assert!(Instant::now() < end, "{:?}", standing(setting, &bad));
        nothing_for(setting, &worker("w"));
    }
    let outcome = standing(setting, &bad).outcome.expect("it has one");
    let Ending::Failed { error, hint } = outcome.ending else {
        unreachable!("it failed");
    };
    assert!(error.contains(&MOST_CUT_SHORT.to_string()), "{error}");
    assert!(hint.is_some(), "it says what to do");
    offer(setting, &good);
    let mut lease = take(setting, &worker("w"));
    assert_eq!(lease.order().key, good.key);
    lease.settle(&done("r")).expect("it is settled");
}

pub(super) fn alive_beyond_deadline(setting: &mut dyn Setting) {
    let Some(deadline) = setting.deadline() else {
        return;
    };
    let order = order(setting, 1);
    offer(setting, &order);
    let mut lease = take(setting, &worker("slow"));
    let queue = setting.queue();
    let end = Instant::now() + deadline * 5 / 2;
    while Instant::now() < end {
        assert_eq!(lease.stop(), None);
        lease.tell("segment", 0.5, None);
        let taken = queue.take(&worker("other"), Duration::from_millis(50));
        assert!(taken.expect("the queue gives out orders").is_none());
    }
    let settled = lease.settle(&done("r")).expect("it is settled");
    assert_eq!(settled.attempts, 1);
}

pub(super) fn late_settle_counts_once(setting: &mut dyn Setting) {
    let Some(believed_dead) = setting.believed_dead() else {
        return;
    };
    // One is settled by the second worker first, one by the first worker.
    for (n, first_is_late) in [(1, true), (2, false)] {
        let order = order(setting, n);
        offer(setting, &order);
        let taken = believed_dead.take(&worker("first"), setting.patience());
        let mut first = taken.expect("it is given out").expect("there is an order");
        let mut second = take(setting, &worker("second"));
        assert_eq!(second.order().key, order.key);
        assert_eq!(second.begun().attempts, 2);
        assert_eq!(wait_for_stop(setting, &*first), Stop::Lost);
        if first_is_late {
            let settled = second.settle(&done("second")).expect("it is settled");
            // The outcome of the other, or nothing.
            match first.settle(&failed("first")) {
                Ok(found) => assert_eq!(found, settled),
                Err(QueueError::Lost(key)) => assert_eq!(key, order.key),
                Err(error) => unreachable!("{error}"),
            }
            assert_eq!(standing(setting, &order), settled);
        } else {
            let early = first.settle(&done("first"));
            let settled = second.settle(&done("second")).expect("it is settled");
            match early {
                Ok(found) => assert_eq!(found, settled, "the first one counts"),
                Err(QueueError::Lost(key)) => assert_eq!(key, order.key),
                Err(error) => unreachable!("{error}"),
            }
            assert_eq!(standing(setting, &order), settled);
        }
        assert!(first.give_back().is_err() || standing(setting, &order).state.is_over());
        nothing_for(setting, &worker("w"));
    }
}

pub(super) fn needs_are_respected(setting: &mut dyn Setting) {
    let mut large = order(setting, 1);
    large.need.memory_mib = 3000;
    let mut tooled = order(setting, 2);
    tooled.need.tools = tools(&["occt", "blender"]);
    let small = order(setting, 3);
    for order in [&large, &tooled, &small] {
        offer(setting, order);
    }
    let mut plain = worker("plain");
    plain.memory_mib = Some(2048);
    plain.tools = tools(&["occt"]);
    // What waits for others stands in nobody's way.
    let mut lease = take(setting, &plain);
    assert_eq!(lease.order().key, small.key);
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &plain);
    let mut able = plain.clone();
    able.memory_mib = Some(4096);
    let mut lease = take(setting, &able);
    assert_eq!(lease.order().key, large.key);
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &able);
    let mut skilled = plain;
    skilled.tools = tools(&["blender", "occt", "openscad"]);
    let mut lease = take(setting, &skilled);
    assert_eq!(lease.order().key, tooled.key);
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &skilled);
}

pub(super) fn formats_are_respected(setting: &mut dyn Setting) {
    let now = order(setting, 1);
    let mut later = order(setting, 2);
    later.format = FORMAT + 1;
    offer(setting, &now);
    offer(setting, &later);
    let mut future = worker("future");
    future.formats = FORMAT + 2..=FORMAT + 3;
    nothing_for(setting, &future);
    let mut newer = worker("newer");
    newer.formats = FORMAT + 1..=FORMAT + 1;
    let mut lease = take(setting, &newer);
    assert_eq!(lease.order().key, later.key);
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &newer);
    let mut lease = take(setting, &worker("of-now"));
    assert_eq!(lease.order().key, now.key);
    lease.settle(&done("r")).expect("it is settled");
    nothing_for(setting, &worker("of-now"));
}

pub(super) fn each_of_many_settled_once(setting: &mut dyn Setting) {
    const ORDERS: u64 = 200;
    for n in 1..=ORDERS {
        let order = order(setting, n);
        offer(setting, &order);
    }
    let (queue, glance) = (setting.queue(), setting.glance());
    let settled = Mutex::new(BTreeMap::<_, u32>::new());
    thread::scope(|scope| {
        for n in 0..8 {
            let (queue, settled) = (&queue, &settled);
            scope.spawn(move || {
                let me = worker(&format!("w{n}"));
                while let Some(mut lease) = queue.take(&me, glance).expect("it is given out") {
                    assert_eq!(lease.stop(), None);
                    let outcome = done(&me.name);
                    let standing = lease.settle(&outcome).expect("it is settled");
                    assert_eq!(standing.outcome, Some(outcome));
                    let key = lease.order().key.clone();
                    *settled
                        .lock()
                        .expect("no thread panicked")
                        .entry(key)
                        .or_default() += 1;
                }
            });
        }
    });
    let settled = settled.into_inner().expect("no thread panicked");
    assert_eq!(settled.len() as u64, ORDERS);
    assert!(settled.values().all(|&times| times == 1), "{settled:?}");
    for n in 1..=ORDERS {
        let order = order(setting, n);
        let standing = wait_for(setting, &order, JobState::Done);
        assert_eq!(standing.attempts, 1);
    }
}
