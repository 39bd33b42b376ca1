//! What goes first, and what is the same.

use relief_api::JobState;

use super::{Setting, done, nothing_for, offer, order, standing, take, worker};
use crate::Priority;

pub(super) fn priority_then_age(setting: &mut dyn Setting) {
    let offered = [
        (1, Priority::Low),
        (2, Priority::Normal),
        (3, Priority::High),
        (4, Priority::Normal),
        (5, Priority::High),
    ];
    for (n, priority) in offered {
        let mut order = order(setting, n);
        order.priority = priority;
        offer(setting, &order);
    }
    for n in [3, 5, 2, 4, 1] {
        let mut lease = take(setting, &worker("w"));
        assert_eq!(lease.order().key, setting.key(n));
        assert_eq!(lease.order().body["n"], n, "what is to be done comes along");
        lease.settle(&done("r")).expect("it is settled");
    }
    nothing_for(setting, &worker("w"));
}

pub(super) fn same_turn_is_one(setting: &mut dyn Setting) {
    let order = order(setting, 1);
    offer(setting, &order);
    setting.queue().offer(&order).expect("it may be repeated");
    let mut lease = take(setting, &worker("w"));
    setting.queue().offer(&order).expect("it may be repeated");
    nothing_for(setting, &worker("v"));
    assert_eq!(standing(setting, &order).state, JobState::Running);
    lease.settle(&done("r")).expect("it is settled");
    setting.queue().offer(&order).expect("it may be repeated");
    nothing_for(setting, &worker("v"));
    let standing = standing(setting, &order);
    assert_eq!((standing.state, standing.attempts), (JobState::Done, 1));
}

pub(super) fn waiting_survives_restart_in_order(setting: &mut dyn Setting) {
    for n in 1..=6 {
        let mut order = order(setting, n);
        if n == 5 {
            order.priority = Priority::High;
        }
        offer(setting, &order);
    }
    setting.restart();
    for n in [5, 1, 2, 3, 4, 6] {
        let mut lease = take(setting, &worker("w"));
        assert_eq!(lease.order().key, setting.key(n));
        assert_eq!(lease.begun().attempts, 1);
        lease.settle(&done("r")).expect("it is settled");
    }
    nothing_for(setting, &worker("w"));
}
