//! Nodes of no region, given to one.

use range_image::RangeImage;

use super::pieces::pieces;
use super::{NONE, OUTSIDE, Region, Regions, UNKNOWN_MM};

/// A void that is at most so many nodes from the nearest region everywhere is a gap between
/// samples or the dust beside a step, and no hollow.
const THIN: u32 = 2;

/// Lets the regions around each connected piece of unlabelled nodes grow into it, all but the
/// highest where they are of different heights; makes it a void where it is wide and all around
/// it is of one height.
pub(super) fn fill(image: &RangeImage, divided: &mut Regions, step_mm: f64) {
    let unlabelled = |node: usize| divided.labels[node] == NONE;
    let pieces = pieces(divided.columns, divided.rows, &unlabelled, &|_, _| true);
    for piece in pieces {
        let is_framed = piece.iter().any(|node| divided.at_frame(*node));
        let mut around: Vec<(u16, f64)> = Vec::new();
        for &node in &piece {
            for other in divided.neighbours(node) {
                let label = divided.labels[other];
                if label != NONE {
                    let z_mm = divided.height_mm(image, other).unwrap_or(UNKNOWN_MM);
                    match around.iter_mut().find(|(l, _)| *l == label) {
                        Some((_, z)) => *z = z.min(z_mm),
                        None => around.push((label, z_mm)),
                    }
                }
            }
        }
        let is_thin = depth(divided, &piece) <= THIN;
        let lowest = around.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let highest = around.iter().map(|a| a.1).fold(f64::NEG_INFINITY, f64::max);
        match lowest {
            // Beyond what was seen lies whatever surrounds the part.
            _ if is_framed && !is_thin => give(divided, &piece, OUTSIDE),
            // What is hidden is hidden by the highest: the others go on below it, each where it is
            // nearest.
            Some((_, z_mm)) if highest - z_mm > step_mm => {
                let low: Vec<u16> = around
                    .iter()
                    .filter(|(_, z)| highest - z > step_mm)
                    .map(|(label, _)| *label)
                    .collect();
                spread(divided, &piece, &|label| low.contains(&label));
            }
            Some(_) if is_thin => spread(divided, &piece, &|_| true),
            Some(_) => {
                let label = u16::try_from(divided.regions.len()).unwrap_or(OUTSIDE);
                divided.regions.push(Region::Void);
                give(divided, &piece, label);
            }
            None => give(divided, &piece, OUTSIDE),
        }
    }
}

fn give(divided: &mut Regions, piece: &[usize], label: u16) {
    for node in piece {
        divided.labels[*node] = label;
    }
}

/// Steps from the border of a piece to its innermost node.
fn depth(divided: &Regions, piece: &[usize]) -> u32 {
    let mut ring: Vec<usize> = piece
        .iter()
        .copied()
        .filter(|n| divided.neighbours(*n).any(|o| divided.labels[o] != NONE))
        .collect();
    let mut reached: std::collections::BTreeSet<usize> = ring.iter().copied().collect();
    let mut steps = 0;
    while !ring.is_empty() {
        steps += 1;
        let mut further = Vec::new();
        for &node in &ring {
            for other in divided.neighbours(node) {
                if divided.labels[other] == NONE && reached.insert(other) {
                    further.push(other);
                }
            }
        }
        ring = further;
    }
    steps
}

/// Lets those regions around a piece that may grow into it, a ring at a time.
fn spread(divided: &mut Regions, piece: &[usize], may: &dyn Fn(u16) -> bool) {
    let mut left: Vec<usize> = piece.to_vec();
    while !left.is_empty() {
        let given: Vec<(usize, u16)> = left
            .iter()
            .filter_map(|&node| {
                let near = divided.neighbours(node).map(|o| divided.labels[o]);
                near.filter(|l| *l != NONE && may(*l))
                    .min()
                    .map(|label| (node, label))
            })
            .collect();
        if given.is_empty() {
            break;
        }
        for &(node, label) in &given {
            divided.labels[node] = label;
        }
        left.retain(|node| divided.labels[*node] == NONE);
    }
}
