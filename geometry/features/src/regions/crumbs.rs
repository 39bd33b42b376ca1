//! Pieces that were too narrow for the segmentation: chamfers and rings of a few nodes.

use range_image::RangeImage;

use super::NONE;
use super::pieces::{neighbours, pieces};

/// Fewest nodes of such a piece, and fewest of them with four neighbours in it.
const FEWEST: usize = 16;
const FEWEST_INSIDE: usize = 5;

/// Labels connected pieces of measured nodes that belong to no region, from `next` + 1 on.
/// Neighbours are connected where they differ by no more than a slope of 60 degrees and a step.
pub(super) fn kept(image: &RangeImage, labels: &mut [u16], next: &mut u16, step_mm: f64) {
    let z = image.raw_z_mm();
    let (rows, columns) = (image.rows(), image.columns());
    let within = 0.5 * step_mm + 1.75 * image.pitch_mm();
    let is_crumb = |node: usize| labels[node] == NONE && !z[node].is_nan();
    let is_near = |node: usize, other: usize| (z[other] - z[node]).abs() <= within;
    let found = pieces(columns, rows, &is_crumb, &is_near);
    let is_inside = |node: &&usize| {
        let same = |other: &usize| is_crumb(*other) && is_near(**node, *other);
        neighbours(columns, rows, **node).filter(same).count() == 4
    };
    let kept: Vec<Vec<usize>> = found
        .into_iter()
        .filter(|piece| {
            piece.len() >= FEWEST && piece.iter().filter(is_inside).count() >= FEWEST_INSIDE
        })
        .collect();
    for piece in kept {
        if *next >= NONE - 2 {
            break;
        }
        *next += 1;
        for node in piece {
            labels[node] = *next;
        }
    }
}
