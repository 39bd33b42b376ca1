//! Nodes without a region join the one whose surface, carried on, explains them best.

use crate::local_fit::{Belief, LocalFit, Sums};
use crate::scene::{NONE, Scene};
use range_image::{Cancelled, Monitor};

/// Half the side of the window of the fits, pitches. Wide, since where two surfaces meet at a
/// small angle their intersection wanders with every error of theirs.
const REACH: usize = 8;
/// So many links away from labelled nodes, surfaces are carried on before they are fitted anew.
const LAYERS: u8 = 4;
/// A surface explains a node that lies off it by less than this share of a step.
const EXPLAINED: f64 = 0.5;
/// Least z of a normal by which a miss is judged, lest a fit that has tipped over explain all.
const STEEPEST: f64 = 0.2;
/// At most this many regions compete for a node.
const RIVALS: usize = 4;

/// The regions that may take a node, best first; [`NONE`] fills up.
type Ranking = [u32; RIVALS];

/// Labels every node that links join to a labelled one.
///
/// Nodes that no surface explains yet wait until surfaces have grown nearer; only when all
/// wait do those next to a region join the nearest in z.
pub(crate) fn regrow(
    scene: &Scene<'_>,
    labels: &mut [u32],
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    loop {
        monitor.check()?;
        let open = front(scene, labels);
        if open.is_empty() {
            return Ok(());
        }
        let mut rankings = vec![[NONE; RIVALS]; open.len()];
        let mut sums = Vec::new();
        for (ranking, &node) in rankings.iter_mut().zip(&open) {
            scene.sums_around(labels, node, (REACH, 1), |_| true, &mut sums);
            *ranking = rank(scene, &sums);
        }
        if !settle(scene, labels, &open, &rankings) {
            join_nearest(scene, labels, &open);
        }
    }
}

/// The unlabelled nodes within [`LAYERS`] links of labelled ones, in the order of nodes.
fn front(scene: &Scene<'_>, labels: &[u32]) -> Vec<usize> {
    let mut layer = vec![0_u8; labels.len()];
    let mut reached: Vec<usize> = Vec::new();
    for (node, &label) in labels.iter().enumerate() {
        if label == NONE && scene.links.linked(node).any(|n| labels[n] != NONE) {
            layer[node] = 1;
            reached.push(node);
        }
    }
    let mut next = 0;
    while let Some(&node) = reached.get(next) {
        next += 1;
        if layer[node] == LAYERS {
            continue;
        }
        for n in scene.links.linked(node) {
            if labels[n] == NONE && layer[n] == 0 {
                layer[n] = layer[node] + 1;
                reached.push(n);
            }
        }
    }
    reached.sort_unstable();
    reached
}

/// First lets every node join its best region, in as many layers as it takes; then one layer
/// of the rest its next best within reach, and so on. Returns whether any node was labelled.
fn settle(scene: &Scene<'_>, labels: &mut [u32], open: &[usize], rankings: &[Ranking]) -> bool {
    let mut waiting: Vec<usize> = (0..open.len()).collect();
    let mut joins = Vec::new();
    let mut choose = |labels: &mut [u32], rivals: usize| {
        joins.clear();
        waiting.retain(|&k| {
            let node = open[k];
            let choice = rankings[k].iter().take(rivals).find(|&&label| {
                label != NONE && scene.links.linked(node).any(|n| labels[n] == label)
            });
            joins.extend(choice.map(|&label| (node, label)));
            choice.is_none()
        });
        for &(node, label) in &joins {
            labels[node] = label;
        }
        !joins.is_empty()
    };
    let mut any = false;
    while choose(labels, 1) || choose(labels, RIVALS) {
        any = true;
    }
    any
}

/// Gives every node beside a region the label of the linked neighbour nearest in z.
fn join_nearest(scene: &Scene<'_>, labels: &mut [u32], open: &[usize]) {
    let z = scene.grid.z_mm;
    let joins: Vec<(usize, u32)> = open
        .iter()
        .filter_map(|&node| {
            let off = |n: usize| (z[n] - z[node]).abs();
            let beside = scene.links.linked(node).filter(|&n| labels[n] != NONE);
            let nearest = beside.min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
            Some((node, labels[nearest]))
        })
        .collect();
    for (node, label) in joins {
        labels[node] = label;
    }
}

/// Orders the regions around a node by how well they explain it; the node is the origin.
fn rank(scene: &Scene<'_>, sums: &[Sums]) -> Ranking {
    let mut rivals: Vec<(f64, u32, LocalFit)> = sums
        .iter()
        .filter_map(|sums| {
            let fit = sums.fit(Belief::Reluctant)?;
            Some((miss_mm(scene, &fit), sums.label, fit))
        })
        .filter(|rival| rival.0 < EXPLAINED * scene.step_mm)
        .collect();
    rivals.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    if let [first, second, ..] = rivals.as_slice()
        && beyond_intersection(&first.2, &second.2)
    {
        rivals.swap(0, 1);
    }
    let mut ranking = [NONE; RIVALS];
    for (slot, rival) in ranking.iter_mut().zip(rivals) {
        *slot = rival.1;
    }
    ranking
}

/// How far the node lies off the surface, millimetres square to it.
fn miss_mm(scene: &Scene<'_>, fit: &LocalFit) -> f64 {
    fit.z_mm(0.0, 0.0).abs() * fit.normal(scene.grid.pitch_mm, 0.0, 0.0)[2].max(STEEPEST)
}

/// Whether the node lies on the second's side of the line where two surfaces meet.
///
/// The node's own noise has no say in this, so borders along creases come out straight.
fn beyond_intersection(first: &LocalFit, second: &LocalFit) -> bool {
    let lead = |u: f64, v: f64| first.z_mm(u, v) - second.z_mm(u, v);
    // Halfway to where the nodes are: far enough to tell, near enough to trust.
    let at_first = lead(0.5 * first.centroid[0], 0.5 * first.centroid[1]);
    let at_second = lead(0.5 * second.centroid[0], 0.5 * second.centroid[1]);
    let here = lead(0.0, 0.0);
    at_first * at_second < 0.0 && here * at_second > 0.0
}
