//! What holds the parts of a narrow face together where no links do.

use std::collections::BTreeMap;

use super::{HOP, around};
use crate::relief::piece::Pieces;
use crate::scene::{NONE, Scene};

/// Four of a node's eight neighbours, columns and rows away; of the others it is one.
const AFTER: [(isize, isize); 4] = [(0, 1), (1, -1), (1, 0), (1, 1)];

/// Gives strips, from this label on, the nodes between their parts: where a strip is hardly wider
/// than the pitch it may pass between nodes.
pub(crate) fn bridge(scene: &Scene<'_>, pieces: &mut Pieces, first: u32) {
    let members = pieces.members();
    for (label, strip) in members.iter().enumerate().skip(first as usize) {
        // The strip's nodes first, then those nearest to its surface.
        let mut beside: Vec<usize> = strip
            .iter()
            .flat_map(|&n| around(scene, n as usize, HOP))
            .filter(|&n| pieces.labels[n] < first && passes(scene, pieces, label as u32, n))
            .collect();
        beside.sort_unstable();
        beside.dedup();
        let distance = |&n: &usize| {
            let surface = pieces.surfaces[label].as_ref();
            surface.map_or(f64::INFINITY, |s| s.distance_mm(scene, n))
        };
        beside.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let mut order: BTreeMap<usize, usize> = BTreeMap::new();
        for node in strip.iter().map(|&n| n as usize).chain(beside) {
            let next = order.len();
            order.insert(node, next);
        }
        for node in between(scene, &order, strip.len()) {
            pieces.labels[node] = label as u32;
        }
    }
}

/// The nodes after the first so many that join these where they do not touch: a tree through
/// all, which takes nodes in this order, without its idle branches.
fn between(scene: &Scene<'_>, order: &BTreeMap<usize, usize>, own: usize) -> Vec<usize> {
    let mut nodes: Vec<usize> = vec![0; order.len()];
    for (&node, &place) in order {
        nodes[place] = node;
    }
    let mut parts = Parts::new(nodes.len());
    let mut branches = vec![Vec::new(); nodes.len()];
    for (place, &node) in nodes.iter().enumerate() {
        for before in around(scene, node, 1).filter_map(|n| order.get(&n).copied()) {
            if before < place && parts.unite(before, place) {
                branches[place].push(before);
                branches[before].push(place);
            }
        }
    }
    let mut idle: Vec<usize> = (own..nodes.len())
        .filter(|&place| branches[place].len() < 2)
        .collect();
    let mut kept = vec![true; nodes.len()];
    while let Some(place) = idle.pop() {
        kept[place] = false;
        for other in std::mem::take(&mut branches[place]) {
            branches[other].retain(|&b| b != place);
            if other >= own && branches[other].len() == 1 {
                idle.push(other);
            }
        }
    }
    (own..nodes.len())
        .filter(|&place| kept[place])
        .map(|place| nodes[place])
        .collect()
}

/// Whether a surface passes a node by less than the pitch.
fn passes(scene: &Scene<'_>, pieces: &Pieces, label: u32, node: usize) -> bool {
    let surface = pieces.surfaces[label as usize].as_ref();
    surface.is_some_and(|s| s.distance_mm(scene, node) < scene.grid.pitch_mm)
}

/// Pairs of neighbours on the same piece, from this label on, without a link: cornerwise ones,
/// and those with a step between that is none, since both lie on their piece's surface.
pub(crate) fn joints(scene: &Scene<'_>, pieces: &Pieces, first: u32) -> Vec<(usize, usize)> {
    let grid = &scene.grid;
    let mut joints = Vec::new();
    for node in 0..pieces.labels.len() {
        let label = pieces.labels[node];
        if label < first || label == NONE {
            continue;
        }
        let lies_on = |n: usize| passes(scene, pieces, label, n);
        let after = AFTER.map(|(columns, rows)| grid.offset(node, columns, rows));
        for other in after.into_iter().flatten() {
            if pieces.labels[other] == label
                && !scene.links.linked(node).any(|n| n == other)
                && lies_on(node)
                && lies_on(other)
            {
                joints.push((node, other));
            }
        }
    }
    joints
}

/// Which nodes hang together.
struct Parts(Vec<usize>);

impl Parts {
    fn new(nodes: usize) -> Self {
        Self((0..nodes).collect())
    }

    fn root(&mut self, node: usize) -> usize {
        let mut node = node;
        while self.0[node] != node {
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    /// Whether the two did not hang together before.
    fn unite(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }
}
