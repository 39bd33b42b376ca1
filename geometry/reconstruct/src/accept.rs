//! Whether the shape that a region's samples speak for does for its nodes, too.
//!
//! A verdict weighs the region as a whole, so that a dent in a plane hardly counts. The free-form
//! surface has followed it: where the nodes of some place lie off the shape together, and not off
//! that, the region is no such shape.

use std::collections::BTreeMap;

use nurbs::PatchSurface;
use range_image::RangeImage;

use crate::account::residuals;
use crate::run::Node;

/// A shape may leave its nodes so much more than a free-form surface, which follows the noise;
/// and nodes are the middles of windows, which blunt what bends: the second figure in pitches.
const AS_WELL: f64 = 1.5;
const BLUNTED: f64 = 0.02;

/// Side of the blocks of nodes that are looked at, nodes: as wide as the windows whose samples
/// neighbouring nodes share.
const BLOCK: usize = 8;

/// Fewest nodes of a block, of those that it has room for: beside borders windows have samples on
/// one side only, and nodes of steep surfaces are off together for that alone.
const FEWEST: usize = 48;

/// How many deviations of a node, as the free form leaves them, the mean of a block may be off:
/// its nodes share samples, so it is known not much better than one of them.
const TOGETHER: f64 = 6.0;

/// Share of the nodes that may be of something else, as of a wall beside a fillet, and are left out
/// where surfaces are held against each other as a whole.
const STRAYS: f64 = 0.03;

/// Whether a surface does for its nodes as well as the free-form one, on the whole and in every
/// place.
pub(crate) fn is_as_good(
    image: &RangeImage,
    nodes: &[Node],
    surface: &PatchSurface,
    free: &PatchSurface,
) -> bool {
    let most_mm = [surface, free].map(|s| most_of(image, nodes, s));
    let blunted_mm = BLUNTED * image.pitch_mm();
    if most_mm[0] > AS_WELL * most_mm[1] + blunted_mm {
        return false;
    }
    // Along z, as what the blocks are off.
    let (deviation_mm, _) = residuals(image, nodes, free);
    // Of each block: nodes, sum of the nodes off the surface, and sum of their slopes.
    let mut blocks: BTreeMap<(usize, usize), (usize, f64, f64)> = BTreeMap::new();
    for node in nodes {
        let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
        let block = blocks
            .entry((node.column / BLOCK, node.row / BLOCK))
            .or_default();
        let [p, q] = [(1, 0), (0, 1)].map(|(u, v)| surface.z_partial(x, y, u, v));
        block.0 += 1;
        block.1 += node.z_mm - surface.z(x, y);
        block.2 += (1.0 + p * p + q * q).sqrt();
    }
    let mut large = blocks.values().filter(|block| block.0 >= FEWEST);
    large.all(|&(count, off_mm, steepness)| {
        let steepness = steepness / count as f64;
        let allowed_mm = TOGETHER * deviation_mm + blunted_mm * steepness;
        (off_mm / count as f64).abs() <= allowed_mm
    })
}

/// Root mean square distance of the nodes from a surface along its normals, millimetres, but for the
/// few that are the farthest off.
fn most_of(image: &RangeImage, nodes: &[Node], surface: &PatchSurface) -> f64 {
    let off_mm2 = |node: &Node| {
        let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
        let [p, q] = [(1, 0), (0, 1)].map(|(u, v)| surface.z_partial(x, y, u, v));
        (node.z_mm - surface.z(x, y)).powi(2) / (1.0 + p * p + q * q)
    };
    let mut squares_mm2: Vec<f64> = nodes.iter().map(off_mm2).collect();
    squares_mm2.sort_by(f64::total_cmp);
    squares_mm2.truncate(nodes.len() - (STRAYS * nodes.len() as f64) as usize);
    (squares_mm2.iter().sum::<f64>() / squares_mm2.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meeting::testing::{graph, plane};
    use range_image::Lattice;

    const NODES: usize = 60;

    /// Whether a plane of this slope does for nodes that are so far off it along z, and off a free
    /// form that has followed that, by noise alone.
    fn does(slope: f64, noise_mm: f64, off_mm: impl Fn(usize, usize) -> f64) -> bool {
        let image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -30, -30, NODES, NODES);
        let places = (0..NODES).flat_map(|column| (0..NODES).map(move |row| (column, row)));
        let node = |(column, row): (usize, usize)| {
            let stray = ((column * 7 + row * 13) % 11) as f64 / 5.0 - 1.0;
            Node {
                column,
                row,
                z_mm: slope * image.x_mm(column) + off_mm(column, row) + 1.58 * noise_mm * stray,
            }
        };
        let nodes: Vec<Node> = places.map(node).collect();
        let at = |mm: f64| ((mm + 15.0) / 0.5).round().clamp(0.0, NODES as f64 - 1.0) as usize;
        let free = graph(1.5, |x, y| slope * x + off_mm(at(x), at(y)));
        is_as_good(&image, &nodes, &plane(0.0, slope, 0.0), &free)
    }

    #[test]
    fn nodes_of_a_wall_do_not_tell_against_a_shape() {
        // A column of nodes in sixty.
        assert!(does(0.0, 0.01, |column, _| if column == 30 {
            0.3
        } else {
            0.0
        }));
        assert!(!does(0.0, 0.01, |column, _| if column % 15 == 0 {
            0.3
        } else {
            0.0
        }));
    }

    #[test]
    fn what_windows_blunt_of_a_slope_is_no_dent() {
        let block = |off_mm: f64| {
            move |column: usize, row: usize| {
                let is_in = (24..32).contains(&column) && (24..32).contains(&row);
                if is_in { off_mm } else { 0.0 }
            }
        };
        assert!(does(3.0, 0.02, block(0.0)));
        // As far off as is little along the normal.
        assert!(does(3.0, 0.02, block(0.09)));
        assert!(!does(3.0, 0.02, block(0.3)));
        assert!(!does(0.0, 0.01, block(0.15)));
    }
}
