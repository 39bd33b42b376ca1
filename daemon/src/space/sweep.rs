//! Which of the things that are kept go.

use crate::config::Limits;

/// Something that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Kept {
    pub(super) id: String,
    pub(super) bytes: u64,
    /// Since its end.
    pub(super) age_s: u64,
    /// Since somebody acknowledged it, if anybody has.
    pub(super) acknowledged_s: Option<u64>,
    /// Somebody still needs it: it stays, and counts.
    pub(super) needed: bool,
}

/// What goes: all that is too old, and then as much as is too much, what is acknowledged before
/// the rest and of either the oldest first.
pub(super) fn surplus(mut kept: Vec<Kept>, limits: Limits) -> Vec<Kept> {
    // Of equal age by name, so that the order is always the same.
    kept.sort_by(|a, b| {
        let waits = |kept: &Kept| kept.acknowledged_s.is_none();
        waits(a)
            .cmp(&waits(b))
            .then_with(|| b.age_s.cmp(&a.age_s))
            .then_with(|| a.id.cmp(&b.id))
    });
    let mut total: u64 = kept.iter().map(|kept| kept.bytes).sum();
    let (mut surplus, in_time): (Vec<Kept>, Vec<Kept>) = kept
        .into_iter()
        .partition(|kept| !kept.needed && is_overdue(kept, limits));
    total -= surplus.iter().map(|kept| kept.bytes).sum::<u64>();
    for kept in in_time {
        if !kept.needed && limits.bytes.is_some_and(|most| total > most) {
            total -= kept.bytes;
            surplus.push(kept);
        }
    }
    surplus
}

fn is_overdue(kept: &Kept, limits: Limits) -> bool {
    let too_old = limits.age_s.is_some_and(|most| kept.age_s > most);
    let done_with = match (kept.acknowledged_s, limits.acknowledged_s) {
        // Not even for the rest of this second.
        (Some(_), Some(0)) => true,
        (Some(since), Some(most)) => since > most,
        _ => false,
    };
    too_old || done_with
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(id: &str, bytes: u64, age_s: u64, needed: bool) -> Kept {
        Kept {
            id: id.into(),
            bytes,
            age_s,
            acknowledged_s: None,
            needed,
        }
    }

    fn ids(gone: Vec<Kept>) -> Vec<String> {
        gone.into_iter().map(|kept| kept.id).collect()
    }

    #[test]
    fn the_oldest_go_first_and_what_is_needed_stays() {
        let gone = |bytes, age_s| {
            let all = vec![
                kept("new", 10, 1, false),
                kept("needed", 40, 900, true),
                kept("old", 20, 500, false),
                kept("oldest", 30, 800, false),
            ];
            let limits = Limits {
                bytes,
                age_s,
                acknowledged_s: None,
            };
            ids(surplus(all, limits))
        };
        assert!(gone(None, None).is_empty());
        assert!(gone(Some(100), Some(900)).is_empty());
        assert_eq!(gone(None, Some(500)), ["oldest"]);
        assert_eq!(gone(None, Some(499)), ["oldest", "old"]);
        assert_eq!(gone(Some(99), None), ["oldest"]);
        assert_eq!(gone(Some(69), None), ["oldest", "old"]);
        assert_eq!(gone(Some(0), None), ["oldest", "old", "new"]);
    }

    #[test]
    fn what_is_acknowledged_goes_first_and_by_days_of_its_own() {
        let gone = |bytes, age_s, acknowledged_s| {
            let mut all = vec![
                kept("oldest", 30, 800, false),
                kept("fetched", 20, 500, false),
                kept("just-fetched", 10, 700, false),
            ];
            all[1].acknowledged_s = Some(400);
            all[2].acknowledged_s = Some(0);
            let limits = Limits {
                bytes,
                age_s,
                acknowledged_s,
            };
            ids(surplus(all, limits))
        };
        assert!(gone(None, None, None).is_empty());
        assert!(gone(None, None, Some(400)).is_empty());
        assert_eq!(gone(None, None, Some(399)), ["fetched"]);
        assert_eq!(gone(None, None, Some(0)), ["just-fetched", "fetched"]);
        assert_eq!(gone(Some(59), None, None), ["just-fetched"]);
        assert_eq!(gone(Some(49), None, None), ["just-fetched", "fetched"]);
        assert_eq!(gone(Some(29), None, None).len(), 3);
        // What is too old makes the room that others need not make then.
        assert_eq!(gone(Some(30), Some(799), None), ["oldest"]);
    }
}
