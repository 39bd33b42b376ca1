//! How many nodes each pair of regions shares.

use std::collections::BTreeMap;

/// Sizes of the regions of two label images and of their common parts, in nodes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overlaps {
    truth: BTreeMap<u16, usize>,
    machine: BTreeMap<u16, usize>,
    both: BTreeMap<(u16, u16), usize>,
}

impl Overlaps {
    /// Counts nodes of two label images of the same grid. Nodes beyond the shorter one are
    /// left out.
    #[must_use]
    pub fn new(truth: &[u16], machine: &[u16]) -> Self {
        let mut found = Self::default();
        for (&t, &m) in truth.iter().zip(machine) {
            if t != 0 {
                *found.truth.entry(t).or_default() += 1;
            }
            if m != 0 {
                *found.machine.entry(m).or_default() += 1;
            }
            if t != 0 && m != 0 {
                *found.both.entry((t, m)).or_default() += 1;
            }
        }
        found
    }

    /// Truth regions and their sizes, by label.
    pub fn truth(&self) -> impl Iterator<Item = (u16, usize)> {
        self.truth.iter().map(|(label, nodes)| (*label, *nodes))
    }

    /// Machine regions and their sizes, by label.
    pub fn machine(&self) -> impl Iterator<Item = (u16, usize)> {
        self.machine.iter().map(|(label, nodes)| (*label, *nodes))
    }

    /// Nodes of a truth region; 0 if there is none.
    #[must_use]
    pub fn truth_nodes(&self, truth: u16) -> usize {
        self.truth.get(&truth).copied().unwrap_or(0)
    }

    /// Nodes of a machine region; 0 if there is none.
    #[must_use]
    pub fn machine_nodes(&self, machine: u16) -> usize {
        self.machine.get(&machine).copied().unwrap_or(0)
    }

    /// Pairs (truth, machine) that share nodes, and how many, by truth and then machine.
    pub fn pairs(&self) -> impl Iterator<Item = (u16, u16, usize)> {
        self.both.iter().map(|(&(t, m), &nodes)| (t, m, nodes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_counted_by_region_and_by_pair() {
        let overlaps = Overlaps::new(&[1, 1, 1, 2, 2, 0, 0], &[5, 5, 0, 5, 7, 7, 0]);
        assert_eq!(overlaps.truth().collect::<Vec<_>>(), [(1, 3), (2, 2)]);
        assert_eq!(overlaps.machine().collect::<Vec<_>>(), [(5, 3), (7, 2)]);
        let pairs: Vec<_> = overlaps.pairs().collect();
        assert_eq!(pairs, [(1, 5, 2), (2, 5, 1), (2, 7, 1)]);
        assert_eq!(overlaps.truth_nodes(3), 0);
        assert_eq!(overlaps.machine_nodes(7), 2);
    }
}
