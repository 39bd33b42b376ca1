//! Border nodes go to the piece whose surface explains them best.

mod stale;

use super::grow::MISS_NOISES;
use super::piece::Pieces;
use crate::scene::{NONE, Scene};
use range_image::{Cancelled, Monitor};
use stale::Stale;

/// Rounds of deciding borders and fitting surfaces anew.
const ROUNDS: usize = 3;
/// Sweeps over the borders in a round.
const SWEEPS: usize = 4;
/// A node that lies further off than this many noises is no node of the surface's own, and how
/// much further tells little,
const CAP_NOISES: f64 = 4.0;
/// so much for every power of e.
const TAIL: f64 = 2.0;
/// What a neighbour in another piece costs, in squared noises.
const APART: f64 = 0.6;

/// Draws the borders where neither side would gain by a change, and gives the nodes left to the
/// nearest surface.
pub(crate) fn settle(
    scene: &Scene<'_>,
    pieces: &mut Pieces,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    for _ in 0..ROUNDS {
        monitor.check()?;
        let mut stale = Stale::all(&scene.grid);
        for sweep in 0..2 * SWEEPS {
            sweep_borders(scene, pieces, &mut stale, sweep % 2);
        }
        pieces.refit(scene);
        spread(scene, pieces, 1.5 * MISS_NOISES);
    }
    spread(scene, pieces, f64::INFINITY);
    let mut stale = Stale::all(&scene.grid);
    for colour in [0, 1] {
        sweep_borders(scene, pieces, &mut stale, colour);
    }
    Ok(())
}

/// Lets unlabelled nodes join, layer by layer, the piece beside them that they miss least, if
/// by less than so many noises.
pub(crate) fn spread(scene: &Scene<'_>, pieces: &mut Pieces, most: f64) {
    let open = |pieces: &Pieces, n: usize| pieces.labels[n] == NONE && scene.grid.is_valid(n);
    let mut front: Vec<usize> = (0..pieces.labels.len())
        .filter(|&n| open(pieces, n) && scene.links.linked(n).any(|m| pieces.labels[m] != NONE))
        .collect();
    while !front.is_empty() {
        let joins: Vec<(usize, u32)> = front
            .iter()
            .filter_map(|&node| {
                let miss = |label: u32| pieces.miss(scene, label, node);
                let beside = scene.links.linked(node).map(|n| pieces.labels[n]);
                let best = beside
                    .filter(|&label| label != NONE)
                    .min_by(|&a, &b| miss(a).total_cmp(&miss(b)).then(a.cmp(&b)))?;
                (miss(best) <= most).then_some((node, best))
            })
            .collect();
        for &(node, label) in &joins {
            pieces.labels[node] = label;
        }
        let mut next: Vec<usize> = joins
            .iter()
            .flat_map(|&(node, _)| scene.links.linked(node))
            .filter(|&n| open(pieces, n))
            .collect();
        next.sort_unstable();
        next.dedup();
        front = next;
    }
}

/// Decides every second border node anew, as on the fields of one colour of a chessboard: those
/// that are stale, since the others would stay what they are.
fn sweep_borders(scene: &Scene<'_>, pieces: &mut Pieces, stale: &mut Stale, colour: usize) {
    let mut rivals = Vec::new();
    let mut from = 0;
    while let Some(node) = stale.take(colour, from) {
        from = node + 1;
        let best = best(scene, pieces, node, &mut rivals);
        if best != pieces.labels[node] {
            pieces.labels[node] = best;
            stale.add_around(&scene.grid, node);
        }
    }
}

/// The piece that a node is of at the least cost, of its own and those around it.
fn best(scene: &Scene<'_>, pieces: &Pieces, node: usize, rivals: &mut Vec<u32>) -> u32 {
    let grid = &scene.grid;
    let own = pieces.labels[node];
    if own == NONE {
        return own;
    }
    rivals.clear();
    rivals.push(own);
    let (columns, rows) = grid.window(node, 1);
    let mut beside = [NONE; 8];
    let mut count = 0;
    for c in columns {
        for k in c * grid.rows + rows.start..c * grid.rows + rows.end {
            let label = pieces.labels[k];
            if label == NONE || k == node {
                continue;
            }
            beside[count] = label;
            count += 1;
            // Also cornerwise, since a step may leave a node no other link to its own.
            if !rivals.contains(&label) {
                rivals.push(label);
            }
        }
    }
    if rivals.len() == 1 {
        return own;
    }
    let cost = |label: u32| {
        let apart = beside[..count].iter().filter(|&&l| l != label).count();
        cost_of_miss(pieces.miss(scene, label, node)) + pieces.doubt(label) + APART * apart as f64
    };
    let best = rivals
        .iter()
        .map(|&label| (cost(label), label))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(own, |(_, label)| label)
}

/// In squared noises.
fn cost_of_miss(miss: f64) -> f64 {
    if miss <= CAP_NOISES {
        miss * miss
    } else {
        CAP_NOISES * CAP_NOISES + TAIL * libm::log(miss / CAP_NOISES)
    }
}
