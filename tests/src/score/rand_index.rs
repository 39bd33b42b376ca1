//! The adjusted Rand index (Hubert and Arabie 1985, equation 5).

use super::Overlaps;

/// How far two label images agree, whatever the numbers of their labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Adjusted Rand index over the nodes with a label in both: 1 for the same partition, 0
    /// for as much agreement as chance gives.
    pub index: f64,
    /// Nodes with a label in both.
    pub nodes: usize,
    /// Share of them among the nodes with a label in either.
    pub coverage: f64,
}

/// The adjusted Rand index of two label images of the same grid, over the nodes that have a
/// label (not 0) in both. Without such a node, and where both are one and the same single
/// region, there is nothing to disagree on: the index is 1.
#[must_use]
pub fn adjusted_rand_index(one: &[u16], other: &[u16]) -> Agreement {
    let common = |labels: &[u16], beside: &[u16]| -> Vec<u16> {
        let kept = labels.iter().zip(beside);
        kept.map(|(&l, &b)| if b == 0 { 0 } else { l }).collect()
    };
    let overlaps = Overlaps::new(&common(one, other), &common(other, one));
    let pairs = |nodes: usize| nodes as f64 * (nodes as f64 - 1.0) / 2.0;
    let nodes: usize = overlaps.pairs().map(|(_, _, shared)| shared).sum();
    let either = one.iter().zip(other).filter(|(a, b)| **a != 0 || **b != 0);
    let together: f64 = overlaps.pairs().map(|(_, _, shared)| pairs(shared)).sum();
    let in_one: f64 = overlaps.truth().map(|(_, size)| pairs(size)).sum();
    let in_other: f64 = overlaps.machine().map(|(_, size)| pairs(size)).sum();
    let all = pairs(nodes);
    let by_chance = if all > 0.0 {
        in_one * in_other / all
    } else {
        0.0
    };
    let most = (in_one + in_other) / 2.0;
    let index = if most > by_chance {
        (together - by_chance) / (most - by_chance)
    } else {
        1.0
    };
    Agreement {
        index,
        nodes,
        coverage: nodes as f64 / (either.count().max(1)) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn index(one: &[u16], other: &[u16]) -> f64 {
        adjusted_rand_index(one, other).index
    }

    #[test]
    fn the_numbers_of_labels_do_not_matter() {
        assert_eq!(index(&[1, 1, 2, 2, 3], &[9, 9, 4, 4, 1]), 1.0);
        assert_eq!(index(&[1, 1, 1], &[2, 2, 2]), 1.0);
        assert_eq!(index(&[], &[]), 1.0);
    }

    /// Values worked out by hand from the contingency tables.
    #[test]
    fn known_values() {
        // Table [[2, 0], [1, 1]]: together 1, 2 and 3 pairs of 6; (1 - 1) / (2.5 - 1).
        assert_eq!(index(&[1, 1, 2, 2], &[1, 1, 1, 2]), 0.0);
        // Table [[2, 0, 0], [0, 1, 1]]: 1; 2 and 1 of 6; (1 - 1/3) / (3/2 - 1/3) = 4/7.
        let off = index(&[1, 1, 2, 2], &[1, 1, 2, 3]) - 4.0 / 7.0;
        assert!(off.abs() < 1e-15);
        // Crosswise: 0; 2 and 2 of 6; (0 - 2/3) / (2 - 2/3) = -1/2.
        let off = index(&[1, 1, 2, 2], &[1, 2, 1, 2]) + 0.5;
        assert!(off.abs() < 1e-15);
    }

    #[test]
    fn it_does_not_matter_which_is_which() {
        let (one, other) = ([1, 1, 1, 2, 2, 2, 3, 3], [4, 4, 5, 5, 6, 6, 6, 4]);
        assert_eq!(index(&one, &other), index(&other, &one));
    }

    #[test]
    fn nodes_without_a_label_in_both_are_left_out_and_told() {
        let agreement = adjusted_rand_index(&[1, 1, 2, 2, 0, 3, 0], &[1, 1, 2, 2, 7, 0, 0]);
        assert_eq!(agreement.index, 1.0);
        assert_eq!(agreement.nodes, 4);
        assert!((agreement.coverage - 4.0 / 6.0).abs() < 1e-15);
    }
}
