//! Connected components, sizes and depths of labelled nodes.

use crate::grid::{Grid, Links};
use crate::scene::{NONE, Scene};

/// Gives every set of nodes that share a key and are joined by links its own label, counted
/// from `first` in the order of their first nodes. Nodes without a key keep their label.
/// Returns the next free label.
pub(crate) fn label_components<K: PartialEq>(
    grid: &Grid<'_>,
    links: &Links,
    key: impl Fn(usize) -> Option<K>,
    labels: &mut [u32],
    first: u32,
) -> u32 {
    let mut done = vec![false; grid.nodes()];
    let mut stack = Vec::new();
    let mut label = first;
    for start in 0..grid.nodes() {
        if done[start] {
            continue;
        }
        let Some(wanted) = key(start) else { continue };
        done[start] = true;
        stack.push(start);
        while let Some(node) = stack.pop() {
            labels[node] = label;
            for next in links.linked(node) {
                if !done[next] && key(next).is_some_and(|k| k == wanted) {
                    done[next] = true;
                    stack.push(next);
                }
            }
        }
        label += 1;
    }
    label
}

/// Nodes of each label, entry 0 for those without one.
pub(crate) fn sizes(labels: &[u32]) -> Vec<usize> {
    let most = labels.iter().copied().max().unwrap_or(NONE);
    let mut sizes = vec![0; most as usize + 1];
    for &label in labels {
        sizes[label as usize] += 1;
    }
    sizes
}

/// What ends a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// Nodes with a value and another label.
    Neighbours,
    /// These, and masked nodes, steps and the image's edge.
    All,
}

/// How deep each node lies in its region: 0 beside (also cornerwise) a border, 1 beside those
/// nodes, and so on up to `limit`.
pub(crate) fn depths(scene: &Scene<'_>, labels: &[u32], limit: u8, border: Border) -> Vec<u8> {
    let grid = &scene.grid;
    let mut depths: Vec<u8> = (0..grid.nodes())
        .map(|node| {
            if grid.is_valid(node) && is_on_border(scene, labels, node, border) {
                0
            } else {
                limit
            }
        })
        .collect();
    // Two sweeps of the chessboard distance.
    let relax = |depths: &mut [u8], node: usize, offsets: [(isize, isize); 4]| {
        for (c, r) in offsets {
            if let Some(other) = grid.offset(node, c, r) {
                depths[node] = depths[node].min(depths[other].saturating_add(1));
            }
        }
    };
    for node in 0..grid.nodes() {
        relax(&mut depths, node, [(-1, -1), (-1, 0), (-1, 1), (0, -1)]);
    }
    for node in (0..grid.nodes()).rev() {
        relax(&mut depths, node, [(1, 1), (1, 0), (1, -1), (0, 1)]);
    }
    depths
}

fn is_on_border(scene: &Scene<'_>, labels: &[u32], node: usize, border: Border) -> bool {
    let grid = &scene.grid;
    let (columns, rows) = grid.window(node, 1);
    let all = border == Border::All;
    if all && !scene.links.all_around(node) {
        return true;
    }
    columns.into_iter().any(|c| {
        rows.clone().any(|r| {
            let k = c * grid.rows + r;
            labels[k] != labels[node] && (all || grid.is_valid(k))
        })
    })
}
