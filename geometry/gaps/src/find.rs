//! Gaps: connected nodes without a region that the regions enclose.

use std::collections::{BTreeMap, VecDeque};

use crate::sight::Sight;

/// Connected nodes without a region, which reach no border of the image.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// Ascending.
    pub(crate) nodes: Vec<usize>,
    /// Distance of each of them to the nearest node of a region, pitches.
    pub(crate) depth: Vec<f64>,
    /// Nodes of regions beside it, by region.
    pub(crate) beside: BTreeMap<u16, Vec<usize>>,
}

impl Place {
    /// Diameter of the largest circle that fits into it, pitches.
    pub(crate) fn size(&self) -> f64 {
        // Nodes stand for the squares around them: the border runs half a pitch before a node of a region.
        let most = self.depth.iter().copied().fold(0.0, f64::max);
        (2.0 * most - 1.0).max(1.0)
    }
}

/// All gaps by their first nodes.
pub(crate) fn gaps(sight: &Sight<'_>, labels: &[u16]) -> Vec<Place> {
    let grid = sight.grid();
    let mut seen = vec![false; labels.len()];
    let mut found = Vec::new();
    for start in 0..labels.len() {
        if labels[start] != 0 || seen[start] {
            continue;
        }
        seen[start] = true;
        let (mut nodes, mut is_open) = (vec![start], false);
        let mut beside: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
        let mut next = 0;
        while let Some(&node) = nodes.get(next) {
            next += 1;
            is_open |= grid.is_on_border(node);
            for other in grid.beside(node) {
                if labels[other] != 0 {
                    beside.entry(labels[other]).or_default().push(other);
                } else if !seen[other] {
                    seen[other] = true;
                    nodes.push(other);
                }
            }
        }
        if is_open || beside.is_empty() {
            continue;
        }
        for own in beside.values_mut() {
            own.sort_unstable();
            own.dedup();
        }
        nodes.sort_unstable();
        let depth = depths(&grid, &nodes, &beside);
        found.push(Place {
            nodes,
            depth,
            beside,
        });
    }
    found
}

/// Distances to the nodes beside a gap, carried inwards from node to node.
fn depths(grid: &Grid, nodes: &[usize], beside: &BTreeMap<u16, Vec<usize>>) -> Vec<f64> {
    let mut best = vec![(f64::INFINITY, 0_usize); nodes.len()];
    let mut queue: VecDeque<(usize, usize)> = VecDeque::new();
    for &border in beside.values().flatten() {
        queue.extend(grid.around(border).map(|node| (node, border)));
    }
    while let Some((node, border)) = queue.pop_front() {
        let Ok(index) = nodes.binary_search(&node) else {
            continue;
        };
        let far = grid.distance(node, border);
        // Of equal ones that with the lower number, whoever came first.
        if (far, border) < best[index] {
            best[index] = (far, border);
            queue.extend(grid.around(node).map(|other| (other, border)));
        }
    }
    best.into_iter().map(|(far, _)| far).collect()
}

/// Numbers of nodes, and which lie beside which.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Grid {
    pub(crate) fn place(&self, node: usize) -> (usize, usize) {
        (node / self.rows, node % self.rows)
    }

    pub(crate) fn node(&self, column: i64, row: i64) -> Option<usize> {
        let column = usize::try_from(column).ok().filter(|c| *c < self.columns)?;
        let row = usize::try_from(row).ok().filter(|r| *r < self.rows)?;
        Some(column * self.rows + row)
    }

    pub(crate) fn is_on_border(&self, node: usize) -> bool {
        let (column, row) = self.place(node);
        column == 0 || row == 0 || column + 1 == self.columns || row + 1 == self.rows
    }

    fn offsets<'a>(
        &'a self,
        node: usize,
        offsets: &'static [(i64, i64)],
    ) -> impl Iterator<Item = usize> + 'a {
        let (column, row) = self.place(node);
        let at = move |&(c, r): &(i64, i64)| self.node(column as i64 + c, row as i64 + r);
        offsets.iter().filter_map(at)
    }

    /// The four beside a node.
    pub(crate) fn beside(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        self.offsets(node, &[(-1, 0), (0, -1), (0, 1), (1, 0)])
    }

    /// The eight around a node.
    pub(crate) fn around(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        const AROUND: [(i64, i64); 8] = [
            (-1, -1),
            (-1, 0),
            (-1, 1),
            (0, -1),
            (0, 1),
            (1, -1),
            (1, 0),
            (1, 1),
        ];
        self.offsets(node, &AROUND)
    }

    /// Pitches between two nodes.
    pub(crate) fn distance(&self, one: usize, other: usize) -> f64 {
        let (one, other) = (self.place(one), self.place(other));
        let c = one.0 as f64 - other.0 as f64;
        let r = one.1 as f64 - other.1 as f64;
        libm::sqrt(c * c + r * r)
    }

    /// Nodes with how many steps they are away from the first ones, up to a number of steps.
    pub(crate) fn rings(
        &self,
        first: impl Iterator<Item = usize>,
        steps: usize,
        is_passed: impl Fn(usize) -> bool,
    ) -> BTreeMap<usize, usize> {
        let mut found: BTreeMap<usize, usize> = first.map(|node| (node, 0)).collect();
        let mut front: Vec<usize> = found.keys().copied().collect();
        for step in 1..=steps {
            let mut next = Vec::new();
            for node in front {
                for other in self.around(node).filter(|other| is_passed(*other)) {
                    if let std::collections::btree_map::Entry::Vacant(entry) = found.entry(other) {
                        entry.insert(step);
                        next.push(other);
                    }
                }
            }
            front = next;
        }
        found
    }
}
