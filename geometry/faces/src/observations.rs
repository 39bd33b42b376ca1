//! Samples by the nodes they lie at.

use shapes::{Sample, spread};

/// The samples of a range image's regions, each told at which node it lies.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    samples: Vec<Sample>,
    /// Of each node the first of its samples, and one more for the end.
    first: Vec<u32>,
    area: f64,
}

impl Observations {
    /// Samples of an image with so many nodes, each with its node's index, column by column.
    /// `area` is that of [`shapes::fit`]. What lies at no node is left out.
    #[must_use]
    pub fn new(nodes: usize, samples: &[(usize, Sample)], area: f64) -> Self {
        let mut first = vec![0_u32; nodes + 1];
        let known = || samples.iter().filter(|(node, _)| *node < nodes);
        for (node, _) in known() {
            first[node + 1] += 1;
        }
        for node in 0..nodes {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut order = vec![0; first[nodes] as usize];
        for (k, (node, _)) in samples.iter().enumerate().filter(|(_, s)| s.0 < nodes) {
            order[next[*node] as usize] = k;
            next[*node] += 1;
        }
        Self {
            samples: order.into_iter().map(|k| samples[k].1).collect(),
            first,
            area,
        }
    }

    /// How many samples together say as much as one whose noise is its own.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Samples at a node.
    #[must_use]
    pub fn at(&self, node: usize) -> &[Sample] {
        match self.first.get(node..node + 2) {
            Some(&[first, end]) => &self.samples[first as usize..end as usize],
            _ => &[],
        }
    }

    /// At most so many of the samples at these nodes, evenly spread.
    pub(crate) fn of(&self, nodes: &[usize], most: usize) -> Vec<Sample> {
        let all: Vec<&Sample> = nodes.iter().flat_map(|node| self.at(*node)).collect();
        spread(all.len(), most).map(|k| *all[k]).collect()
    }
}
