//! Which nodes each face is made of.
//!
//! A region may fall into several connected pieces, and each becomes a face of its own.
//! Where two nodes of a region touch only by a corner, a rule decides whether they hold
//! together there; the tracing of borders follows the same rule, so that every piece has
//! exactly one outer loop and no loop touches itself.

use std::collections::BTreeMap;

use range_image::RegionMap;

/// Which two of the four nodes around a corner hold together across it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Diagonal {
    /// Lower left and upper right.
    Rising,
    /// Lower right and upper left.
    Falling,
}

/// The diagonal that holds together where nodes of one label touch only by a corner;
/// `None` where there is no such pair. Something wins over nothing, and of two regions
/// the one with the lower label.
pub(crate) fn joined_diagonal<L: Copy + PartialOrd + Default>(
    lower_left: L,
    lower_right: L,
    upper_left: L,
    upper_right: L,
) -> Option<Diagonal> {
    let rising = lower_left == upper_right && lower_left != lower_right && lower_left != upper_left;
    let falling =
        lower_right == upper_left && lower_right != lower_left && lower_right != upper_right;
    match (rising, falling) {
        (false, false) => None,
        (true, false) => Some(Diagonal::Rising),
        (false, true) => Some(Diagonal::Falling),
        (true, true) => {
            let nothing = L::default();
            let rising_wins =
                lower_right == nothing || (lower_left != nothing && lower_left < lower_right);
            Some(if rising_wins {
                Diagonal::Rising
            } else {
                Diagonal::Falling
            })
        }
    }
}

/// Limits on what becomes a face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PieceLimits {
    /// Pieces with fewer nodes are left out.
    pub(crate) min_nodes: usize,
    /// Holes with fewer nodes are filled.
    pub(crate) min_hole_nodes: usize,
}

/// A label for each node: 0 for none, else the number of its piece, from 1.
#[derive(Debug, Clone)]
pub(crate) struct PieceMap {
    columns: usize,
    rows: usize,
    labels: Vec<u32>,
    /// Region of each piece; entry `k` is piece `k + 1`. Never descending.
    pub(crate) regions: Vec<u16>,
    /// Nodes that were in no piece and now lie in one.
    pub(crate) filled_nodes: usize,
    /// Holes filled.
    pub(crate) filled_holes: usize,
    /// What was left out: region, nodes, and whether for thinness.
    pub(crate) rejected: Vec<Rejected>,
}

/// A piece that becomes no face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rejected {
    pub(crate) region: u16,
    pub(crate) nodes: usize,
    pub(crate) thin: bool,
}

impl PieceMap {
    pub(crate) fn new(map: &RegionMap, limits: PieceLimits) -> Self {
        let mut pieces = Self {
            columns: map.columns(),
            rows: map.rows(),
            labels: map.raw_labels().iter().map(|&l| u32::from(l)).collect(),
            regions: (1..=map.regions()).collect(),
            filled_nodes: 0,
            filled_holes: 0,
            rejected: Vec::new(),
        };
        pieces.number();
        pieces.reject(limits.min_nodes);
        pieces.fill(limits.min_hole_nodes);
        pieces.number();
        // A hole filled with one piece may cut off a corner of another.
        pieces.reject(limits.min_nodes);
        pieces.number();
        pieces
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Piece of a node; 0 outside the image.
    pub(crate) fn at(&self, column: i64, row: i64) -> u32 {
        let inside =
            (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
        if inside {
            self.labels[column as usize * self.rows + row as usize]
        } else {
            0
        }
    }

    /// Pieces in the order of nodes of the range image.
    pub(crate) fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// Splits labels into connected pieces, numbered by region and then by first node.
    fn number(&mut self) {
        let (columns, rows) = (self.columns, self.rows);
        let mut sets = Sets::new(self.labels.len());
        for column in 0..columns {
            for row in 0..rows {
                let (here, k) = (self.labels[column * rows + row], column * rows + row);
                if row + 1 < rows && self.labels[k + 1] == here {
                    sets.unite(k, k + 1);
                }
                if column + 1 < columns && self.labels[k + rows] == here {
                    sets.unite(k, k + rows);
                }
                if column + 1 < columns && row + 1 < rows {
                    let l = &self.labels;
                    match joined_diagonal(here, l[k + rows], l[k + 1], l[k + rows + 1]) {
                        Some(Diagonal::Rising) => sets.unite(k, k + rows + 1),
                        Some(Diagonal::Falling) => sets.unite(k + rows, k + 1),
                        None => {}
                    }
                }
            }
        }
        let mut roots: Vec<(u16, usize)> = Vec::new();
        for k in 0..self.labels.len() {
            if self.labels[k] != 0 && sets.root(k) == k {
                roots.push((self.regions[self.labels[k] as usize - 1], k));
            }
        }
        roots.sort_unstable();
        let mut number = vec![0_u32; self.labels.len()];
        for (n, &(_, root)) in roots.iter().enumerate() {
            number[root] = n as u32 + 1;
        }
        for k in 0..self.labels.len() {
            if self.labels[k] != 0 {
                self.labels[k] = number[sets.root(k)];
            }
        }
        self.regions = roots.iter().map(|r| r.0).collect();
    }

    /// Takes out pieces that are too small, or nowhere two nodes wide both ways.
    fn reject(&mut self, min_nodes: usize) {
        let rows = self.rows;
        let mut nodes = vec![0_usize; self.regions.len()];
        let mut broad = vec![false; self.regions.len()];
        for k in 0..self.labels.len() {
            let label = self.labels[k];
            if label == 0 {
                continue;
            }
            nodes[label as usize - 1] += 1;
            let (column, row) = (k / rows, k % rows);
            if column + 1 < self.columns
                && row + 1 < rows
                && [k + 1, k + rows, k + rows + 1]
                    .iter()
                    .all(|&n| self.labels[n] == label)
            {
                broad[label as usize - 1] = true;
            }
        }
        let kept = |k: usize| broad[k] && nodes[k] >= min_nodes;
        for label in &mut self.labels {
            if *label != 0 && !kept(*label as usize - 1) {
                *label = 0;
            }
        }
        for (k, &region) in self.regions.iter().enumerate() {
            if !kept(k) {
                self.rejected.push(Rejected {
                    region,
                    nodes: nodes[k],
                    thin: !broad[k],
                });
            }
        }
    }

    /// Fills small holes with the piece that surrounds the most of them.
    fn fill(&mut self, min_hole_nodes: usize) {
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        let mut seen = vec![false; self.labels.len()];
        for start in 0..self.labels.len() {
            if self.labels[start] != 0 || seen[start] {
                continue;
            }
            let (mut hole, mut open) = (vec![start], false);
            let mut around: BTreeMap<u32, usize> = BTreeMap::new();
            seen[start] = true;
            let mut next = 0;
            while next < hole.len() {
                let (column, row) = (hole[next] as i64 / rows, hole[next] as i64 % rows);
                next += 1;
                for (c, r) in [
                    (column - 1, row),
                    (column + 1, row),
                    (column, row - 1),
                    (column, row + 1),
                ] {
                    if !(0..columns).contains(&c) || !(0..rows).contains(&r) {
                        open = true;
                        continue;
                    }
                    let k = (c * rows + r) as usize;
                    let label = self.labels[k];
                    if label != 0 {
                        *around.entry(label).or_default() += 1;
                    } else if !seen[k] {
                        seen[k] = true;
                        hole.push(k);
                    }
                }
            }
            // Of equal ones the first.
            let most = around.into_iter().rev().max_by_key(|a| a.1);
            if let (Some((label, _)), false) = (most, open)
                && hole.len() < min_hole_nodes
            {
                self.filled_holes += 1;
                self.filled_nodes += hole.len();
                for &k in &hole {
                    self.labels[k] = label;
                }
            }
        }
        // Filling may have joined pieces of one region: give them one label each again.
        let regions = core::mem::take(&mut self.regions);
        for label in &mut self.labels {
            if *label != 0 {
                *label = u32::from(regions[*label as usize - 1]);
            }
        }
        self.regions = (1..=regions.last().copied().unwrap_or(0)).collect();
    }
}

/// Disjoint sets whose root is their least member.
struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
        }
    }

    fn root(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high] = low;
    }
}

/// Names of faces by the regions of their pieces, which are in order.
pub(crate) fn names(regions: &[u16]) -> Vec<String> {
    let mut names = Vec::with_capacity(regions.len());
    for (k, &region) in regions.iter().enumerate() {
        let first = regions.partition_point(|&r| r < region);
        let alone = regions.partition_point(|&r| r <= region) == first + 1;
        names.push(if alone {
            format!("Region {region}")
        } else {
            format!("Region {region} part {}", k - first + 1)
        });
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::region_map;

    fn pieces(picture: &[&str], min_nodes: usize, min_hole_nodes: usize) -> PieceMap {
        PieceMap::new(
            &region_map(picture),
            PieceLimits {
                min_nodes,
                min_hole_nodes,
            },
        )
    }

    #[test]
    fn a_region_in_two_parts_is_two_pieces() {
        let map = pieces(&["aa..aa", "aa..aa", "......", ".bbb..", ".bbb.."], 1, 1);
        assert_eq!(map.regions.len(), 3);
        assert!(map.rejected.is_empty());
        assert_ne!(map.at(0, 4), map.at(5, 4));
    }

    #[test]
    fn lines_and_specks_are_rejected() {
        let map = pieces(&["aaaaaa", ".b..cc", ".b..cc", ".b...."], 5, 1);
        assert!(map.regions.is_empty());
        let thin: Vec<bool> = map.rejected.iter().map(|r| r.thin).collect();
        assert_eq!(thin.iter().filter(|t| **t).count(), 2);
    }

    #[test]
    fn small_holes_are_filled_and_bays_are_not() {
        let map = pieces(
            &["aaaaa.", "a.aa..", "aaaaaa", "aa..aa", "aa..aa", "aaaaaa"],
            1,
            4,
        );
        assert_eq!((map.filled_holes, map.filled_nodes), (1, 1));
        assert_eq!(map.at(1, 4), 1);
        assert_eq!(map.at(2, 1), 0, "a hole of four nodes stays");
        assert_eq!(map.at(5, 5), 0);
    }

    #[test]
    fn corners_hold_by_rule() {
        assert_eq!(joined_diagonal(1, 0, 0, 1), Some(Diagonal::Rising));
        assert_eq!(joined_diagonal(0, 1, 1, 0), Some(Diagonal::Falling));
        assert_eq!(joined_diagonal(2, 1, 1, 2), Some(Diagonal::Falling));
        assert_eq!(joined_diagonal(2, 1, 3, 2), Some(Diagonal::Rising));
        assert_eq!(joined_diagonal(1, 2, 3, 4), None);
        assert_eq!(joined_diagonal(1, 1, 2, 1), None);
    }
}
