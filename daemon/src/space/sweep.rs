//! Which of the things that are kept go.

use crate::config::Limits;

/// Something that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Kept {
    pub(super) id: String,
    pub(super) bytes: u64,
    /// Since its end.
    pub(super) age_s: u64,
    /// Somebody still needs it: it stays, and counts.
    pub(super) needed: bool,
}

/// What goes, the oldest first: all that is too old, and then as much as is too much.
pub(super) fn surplus(mut kept: Vec<Kept>, limits: Limits) -> Vec<Kept> {
    // Of equal age by name, so that the order is always the same.
    kept.sort_by(|a, b| b.age_s.cmp(&a.age_s).then_with(|| a.id.cmp(&b.id)));
    let mut total: u64 = kept.iter().map(|kept| kept.bytes).sum();
    let mut surplus = Vec::new();
    for kept in kept {
        let too_old = limits.age_s.is_some_and(|most| kept.age_s > most);
        let too_much = limits.bytes.is_some_and(|most| total > most);
        if !kept.needed && (too_old || too_much) {
            total -= kept.bytes;
            surplus.push(kept);
        }
    }
    surplus
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(id: &str, bytes: u64, age_s: u64, needed: bool) -> Kept {
        Kept {
            id: id.into(),
            bytes,
            age_s,
            needed,
        }
    }

    fn gone(bytes: Option<u64>, age_s: Option<u64>) -> Vec<String> {
        let all = vec![
            kept("new", 10, 1, false),
            kept("needed", 40, 900, true),
            kept("old", 20, 500, false),
            kept("oldest", 30, 800, false),
        ];
        surplus(all, Limits { bytes, age_s })
            .into_iter()
            .map(|kept| kept.id)
            .collect()
    }

    #[test]
    fn the_oldest_go_first_and_what_is_needed_stays() {
        assert!(gone(None, None).is_empty());
        assert!(gone(Some(100), Some(900)).is_empty());
        assert_eq!(gone(None, Some(500)), ["oldest"]);
        assert_eq!(gone(None, Some(499)), ["oldest", "old"]);
        assert_eq!(gone(Some(99), None), ["oldest"]);
        assert_eq!(gone(Some(69), None), ["oldest", "old"]);
        assert_eq!(gone(Some(0), None), ["oldest", "old", "new"]);
    }
}
