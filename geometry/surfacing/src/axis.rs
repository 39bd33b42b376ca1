//! One direction of the tensor product: its knots, and the basis at each node.
//!
//! Parameters count nodes: node `i` lies at `i`. Lengths come in only at the end.

use nurbs::{BandedCholesky, BandedMatrix, KnotVector};

/// The degree of all surfaces here (Koo & Lee, section 4).
pub(crate) const DEGREE: usize = 3;

/// Most that a basis function may be away from every node of its own, as the least value
/// that it must have at one. Less, and the data hold it so weakly that it rings between
/// nodes (Schoenberg & Whitney ask for any value above 0).
const LEAST_HOLD: f64 = 0.02;

/// Most that the coefficients may grow beyond the data: more, and functions that the nodes hardly
/// tell apart cancel each other at the nodes and swing between them.
const MOST_GAIN: f64 = 40.0;

/// Shortest span, nodes: far shorter ones would lose digits, and say nothing.
const LEAST_SPAN: f64 = 0.05;

/// Of how many knots one is left out at a time.
const REMOVED_OF: usize = 256;

/// Inner knots over the nodes of a direction, ascending, repeated ones as often as they
/// count, at most three times.
#[derive(Debug, Clone, PartialEq)]
pub struct Breaks {
    pub(crate) nodes: usize,
    pub(crate) inner: Vec<f64>,
}

impl Breaks {
    /// No inner knots.
    #[must_use]
    pub fn none(nodes: usize) -> Self {
        Self {
            nodes,
            inner: Vec::new(),
        }
    }

    /// Inner knots, in any order. Those nearly together are put together; those outside of the
    /// nodes, and repeated more than three times, are left out.
    #[must_use]
    pub fn new(nodes: usize, mut inner: Vec<f64>) -> Self {
        let last = nodes.saturating_sub(1) as f64;
        inner.retain(|&t| t >= LEAST_SPAN && t <= last - LEAST_SPAN);
        inner.sort_by(f64::total_cmp);
        let mut kept: Vec<f64> = Vec::with_capacity(inner.len());
        for mut t in inner {
            if let Some(&before) = kept.last()
                && t - before < LEAST_SPAN
            {
                t = before;
            }
            let times = kept.iter().rev().take_while(|&&k| k == t).count();
            if times < DEGREE {
                kept.push(t);
            }
        }
        Self { nodes, inner: kept }
    }

    /// Equal spans.
    #[must_use]
    pub fn uniform(nodes: usize, spans: usize) -> Self {
        let last = nodes.saturating_sub(1) as f64;
        let inner = (1..spans).map(|k| last * k as f64 / spans as f64);
        Self::new(nodes, inner.collect())
    }

    /// The inner knots, in nodes.
    #[must_use]
    pub fn inner(&self) -> &[f64] {
        &self.inner
    }

    /// Number of control points along this direction.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.inner.len() + DEGREE + 1
    }

    /// Knots and the last parameter, in nodes: the ends of the spans, distinct.
    pub(crate) fn edges(&self) -> Vec<f64> {
        let mut edges = vec![0.0];
        edges.extend(&self.inner);
        edges.push(self.nodes.saturating_sub(1) as f64);
        edges.dedup();
        edges
    }

    /// The knot vector over nodes (`first` 0, `pitch` 1) or over lengths.
    pub(crate) fn knot_vector(&self, first: f64, pitch: f64) -> Option<KnotVector> {
        let last = first + self.nodes.saturating_sub(1) as f64 * pitch;
        let mut knots = vec![first; DEGREE + 1];
        knots.extend(self.inner.iter().map(|t| first + t * pitch));
        knots.extend([last; DEGREE + 1]);
        KnotVector::new(DEGREE, knots).ok()
    }

    /// The same knots without number `index`.
    pub(crate) fn without(&self, index: usize) -> Self {
        let mut inner = self.inner.clone();
        if index < inner.len() {
            inner.remove(index);
        }
        Self {
            nodes: self.nodes,
            inner,
        }
    }

    /// Leaves out knots until each basis function is held by a node: of 256 and fewer one at a
    /// time, of more a 256th of them, so that the work grows with their number and no faster.
    #[must_use]
    pub fn solvable(mut self) -> Self {
        while Axis::new(&self).is_none() && !self.inner.is_empty() {
            // The narrowest support is held least.
            let all = {
                let mut all = vec![0.0; DEGREE + 1];
                all.extend(&self.inner);
                all.extend([self.nodes.saturating_sub(1) as f64; DEGREE + 1]);
                all
            };
            let width = |k: usize| {
                let at = k + DEGREE + 1;
                all[at + 2] - all[at - 2]
            };
            let mut by_width: Vec<usize> = (0..self.inner.len()).collect();
            by_width.sort_by(|&a, &b| width(a).total_cmp(&width(b)));
            by_width.truncate(self.inner.len().div_ceil(REMOVED_OF));
            let mut is_kept = vec![true; self.inner.len()];
            for narrowest in by_width {
                // The loss of a neighbour has made this one wide.
                let beside = narrowest.saturating_sub(2)..(narrowest + 3).min(is_kept.len());
                if is_kept[beside].iter().all(|is_kept| *is_kept) {
                    is_kept[narrowest] = false;
                }
            }
            let mut kept = is_kept.into_iter();
            self.inner.retain(|_| kept.next().unwrap_or(true));
        }
        self
    }
}

/// The basis functions that do not vanish at a node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AtNode {
    pub(crate) first: usize,
    pub(crate) values: [f64; DEGREE + 1],
}

/// A direction that can be fitted: its basis at the nodes, and its factored normal matrix.
pub(crate) struct Axis {
    pub(crate) count: usize,
    pub(crate) at: Vec<AtNode>,
    system: BandedCholesky,
}

impl Axis {
    /// `None` where the nodes do not hold every basis function.
    pub(crate) fn new(breaks: &Breaks) -> Option<Self> {
        let knots = breaks.knot_vector(0.0, 1.0)?;
        let count = knots.control_count();
        if count > breaks.nodes {
            return None;
        }
        let at: Vec<AtNode> = (0..breaks.nodes)
            .map(|i| {
                let basis = knots.basis(i as f64);
                let mut values = [0.0; DEGREE + 1];
                values.copy_from_slice(&basis.values[..=DEGREE]);
                AtNode {
                    first: basis.first,
                    values,
                }
            })
            .collect();
        if !is_held(&at, count) {
            return None;
        }
        let mut matrix = BandedMatrix::zero(count, DEGREE);
        for node in &at {
            for k in 0..=DEGREE {
                for l in 0..=k {
                    matrix.add(
                        node.first + k,
                        node.first + l,
                        node.values[k] * node.values[l],
                    );
                }
            }
        }
        let system = matrix.cholesky().ok()?;
        let axis = Self { count, at, system };
        (axis.gain() <= MOST_GAIN).then_some(axis)
    }

    /// The greatest coefficient of data that are 1 or -1, in an order without a pattern.
    fn gain(&self) -> f64 {
        let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
        let mut greatest = 0.0_f64;
        for _ in 0..2 {
            let mut line = vec![0.0; self.count];
            for node in &self.at {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let sign = if state >> 63 == 0 { 1.0 } else { -1.0 };
                for (k, value) in node.values.iter().enumerate() {
                    line[node.first + k] += sign * value;
                }
            }
            self.solve(&mut line);
            greatest = line.iter().fold(greatest, |most, c| most.max(c.abs()));
        }
        greatest
    }

    /// Solves the normal equations of this direction, in place.
    pub(crate) fn solve(&self, rhs: &mut [f64]) {
        self.system.solve(rhs);
    }
}

/// Whether each function can be given a node of its own at which it is not small: the
/// condition of Schoenberg & Whitney with a margin.
fn is_held(at: &[AtNode], count: usize) -> bool {
    let value = |node: &AtNode, function: usize| {
        let k = function.checked_sub(node.first)?;
        node.values.get(k).copied()
    };
    let mut node = 0;
    for function in 0..count {
        loop {
            let Some(here) = at.get(node) else {
                return false;
            };
            node += 1;
            if value(here, function).is_some_and(|v| v >= LEAST_HOLD) {
                break;
            }
            if here.first > function {
                return false;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_closer_than_nodes_are_left_out() {
        let crowded = Breaks::new(20, vec![5.1, 5.2, 5.3, 5.4, 5.5, 5.6, 5.7, 12.0]);
        assert!(Axis::new(&crowded).is_none());
        let solvable = crowded.solvable();
        assert!(Axis::new(&solvable).is_some());
        assert!(solvable.inner().contains(&12.0));
        // A knot at each node but the second and the last but one interpolates.
        let every = Breaks::new(20, (2..18).map(f64::from).collect());
        assert_eq!(every.control_count(), 20);
        assert!(Axis::new(&every).is_some());
    }

    #[test]
    fn many_crowded_knots_are_left_out_at_once() {
        // Two a node over 8000 nodes: one at a time would take 8000 factorisations.
        let crowded = Breaks::new(8000, (2..16_000).map(|k| f64::from(k) * 0.5).collect());
        let before = crowded.inner().len();
        let solvable = crowded.solvable();
        assert!(Axis::new(&solvable).is_some());
        assert!(
            before > 15_900 && solvable.inner().len() > 3000,
            "{}",
            solvable.inner().len()
        );
    }

    #[test]
    fn no_knot_is_repeated_more_than_three_times() {
        let breaks = Breaks::new(30, vec![7.0; 5]);
        assert_eq!(breaks.inner(), [7.0; 3]);
        assert!(Axis::new(&breaks).is_some());
        assert_eq!(breaks.edges(), [0.0, 7.0, 29.0]);
    }
}
