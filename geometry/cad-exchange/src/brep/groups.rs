//! Things that belong together.

use std::collections::BTreeMap;

/// Sets of things that are joined one pair at a time.
pub(super) struct Groups(Vec<usize>);

impl Groups {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The least member of a thing's set.
    fn least(&self, mut of: usize) -> usize {
        while self.0[of] != of {
            of = self.0[of];
        }
        of
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.least(a), self.least(b));
        self.0[a.max(b)] = a.min(b);
    }

    /// Whether two things are in one set.
    pub(super) fn are_joined(&self, a: usize, b: usize) -> bool {
        self.least(a) == self.least(b)
    }

    /// The sets, ordered by their least members; members ascend.
    pub(super) fn groups(&self) -> Vec<Vec<usize>> {
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for k in 0..self.0.len() {
            groups.entry(self.least(k)).or_default().push(k);
        }
        groups.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_ordered_by_their_least_members() {
        let mut groups = Groups::new(6);
        groups.join(5, 3);
        groups.join(1, 5);
        groups.join(4, 2);
        assert!(groups.are_joined(3, 1) && !groups.are_joined(0, 1));
        assert_eq!(groups.groups(), [vec![0], vec![1, 3, 5], vec![2, 4]]);
    }
}
