//! Pieces that were too narrow for the segmentation: chamfers and rings of a few nodes.

use range_image::RangeImage;

use super::NONE;

/// Fewest nodes of such a piece, and fewest of them with four neighbours in it.
const FEWEST: usize = 16;
const FEWEST_INSIDE: usize = 5;

/// Labels connected pieces of measured nodes that belong to no region, from `next` + 1 on.
/// Neighbours are connected where they differ by no more than a slope of 60 degrees and a step.
pub(super) fn kept(image: &RangeImage, labels: &mut [u16], next: &mut u16, step_mm: f64) {
    let z = image.raw_z_mm();
    let (rows, columns) = (image.rows(), image.columns());
    let within = 0.5 * step_mm + 1.75 * image.pitch_mm();
    let beside = |node: usize| {
        let (column, row) = (node / rows, node % rows);
        [
            (column > 0).then(|| node - rows),
            (column + 1 < columns).then(|| node + rows),
            (row > 0).then(|| node - 1),
            (row + 1 < rows).then(|| node + 1),
        ]
    };
    let mut seen = vec![false; labels.len()];
    for start in 0..labels.len() {
        if seen[start] || labels[start] != NONE || z[start].is_nan() {
            continue;
        }
        seen[start] = true;
        let mut piece = vec![start];
        let (mut at, mut inside) = (0, 0);
        while at < piece.len() {
            let node = piece[at];
            at += 1;
            let mut around = 0;
            for other in beside(node).into_iter().flatten() {
                let same = labels[other] == NONE && (z[other] - z[node]).abs() <= within;
                around += usize::from(same);
                if same && !seen[other] {
                    seen[other] = true;
                    piece.push(other);
                }
            }
            inside += usize::from(around == 4);
        }
        if piece.len() >= FEWEST && inside >= FEWEST_INSIDE && *next < NONE - 2 {
            *next += 1;
            for node in piece {
                labels[node] = *next;
            }
        }
    }
}
