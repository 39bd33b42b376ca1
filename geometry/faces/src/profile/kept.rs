//! Borders that a profile tells.

use std::collections::BTreeSet;

/// Which labels are pieces of the same profile. The borders between these are where the profile has
/// its breaks: it tells them better than the nodes beside them do.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    /// Of each label the profiles that it holds pieces of.
    profiles: Vec<BTreeSet<usize>>,
}

impl Kept {
    /// Makes a label a piece of a profile.
    pub(crate) fn add(&mut self, label: u16, profile: usize) {
        let label = usize::from(label);
        if self.profiles.len() <= label {
            self.profiles.resize(label + 1, BTreeSet::new());
        }
        self.profiles[label].insert(profile);
    }

    /// Whether two labels are pieces of the same profile.
    pub(crate) fn are_apart(&self, a: u16, b: u16) -> bool {
        let of = |label: u16| self.profiles.get(usize::from(label));
        a != b && of(a).zip(of(b)).is_some_and(|(a, b)| !a.is_disjoint(b))
    }

    /// Makes a label hold what another does.
    pub(crate) fn unite(&mut self, label: u16, other: u16) {
        let of_other = self.profiles.get(usize::from(other)).cloned();
        for profile in of_other.into_iter().flatten() {
            self.add(label, profile);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_a_profile_stay_apart_whatever_joins_them() {
        let mut kept = Kept::default();
        kept.add(2, 0);
        kept.add(5, 0);
        kept.add(3, 1);
        assert!(kept.are_apart(2, 5) && !kept.are_apart(2, 2));
        assert!(!kept.are_apart(2, 3) && !kept.are_apart(9, 2));
        kept.unite(1, 5);
        kept.unite(1, 7);
        assert!(kept.are_apart(1, 2) && !kept.are_apart(1, 3));
    }
}
