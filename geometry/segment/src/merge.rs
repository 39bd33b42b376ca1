//! Neighbouring regions whose common border is neither crease nor step become one.
//!
//! The paper (II.2) prints the condition the wrong way round; Hoffman & Jain 1987, whom it
//! follows, merge where the border is not a crease.

use crate::scene::{NONE, Scene};
use range_image::{Cancelled, Monitor};

/// A pair of linked nodes in two regions; `first` is the one with the lower number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pair {
    pub(crate) first: u32,
    pub(crate) to_the_right: bool,
}

#[derive(Debug)]
pub(crate) struct Border {
    /// The two regions, lower label first.
    pub(crate) regions: (u32, u32),
    pub(crate) pairs: Vec<Pair>,
    /// How many neighbouring nodes of the two have a step between them instead of a link, of
    /// pieces that have a link, too.
    pub(crate) steps: usize,
    /// Below 1 the border is neither crease nor step; `None` where nothing could be measured.
    strength: Option<f64>,
    stale: bool,
}

/// Merges until every border left is a crease or a step: always the weakest border first,
/// and what has changed is measured again. `strength` tells how much of a crease or step a
/// border is, given the nodes of the two regions; 1 is the least that counts, and `None`
/// stands where nothing can be measured.
pub(crate) fn merge(
    scene: &Scene<'_>,
    labels: &mut [u32],
    strength: impl Fn(&[u32], &Border, [usize; 2]) -> Option<f64>,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let mut borders = borders(scene, labels);
    let most = labels.iter().copied().max().unwrap_or(NONE) as usize;
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); most + 1];
    for (node, &label) in labels.iter().enumerate() {
        if label != NONE {
            members[label as usize].push(node);
        }
    }
    loop {
        for border in borders.iter_mut().filter(|b| b.stale) {
            monitor.check()?;
            let (a, b) = border.regions;
            let sizes = [a, b].map(|label| members[label as usize].len());
            border.strength = strength(labels, border, sizes);
            border.stale = false;
        }
        let weakest = borders
            .iter()
            .filter_map(|b| b.strength.map(|s| (s, b.regions)))
            .filter(|(s, _)| *s < 1.0)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let Some((_, (kept, lost))) = weakest else {
            return Ok(());
        };
        let moved = core::mem::take(&mut members[lost as usize]);
        for &node in &moved {
            labels[node] = kept;
        }
        members[kept as usize].extend(moved);
        rename(&mut borders, kept, lost);
    }
}

/// Borders of `lost` become borders of `kept`; those that coincide are joined.
fn rename(borders: &mut Vec<Border>, kept: u32, lost: u32) {
    borders.retain(|b| b.regions != (kept, lost));
    for border in borders.iter_mut() {
        let (a, b) = border.regions;
        let renamed = |l: u32| if l == lost { kept } else { l };
        let (a, b) = (renamed(a), renamed(b));
        border.regions = (a.min(b), a.max(b));
        border.stale |= a == kept || b == kept;
    }
    borders.sort_by_key(|b| b.regions);
    borders.dedup_by(|next, border| {
        let same = next.regions == border.regions;
        if same {
            border.pairs.append(&mut next.pairs);
            border.pairs.sort_unstable();
            border.steps += next.steps;
        }
        same
    });
}

/// The borders between regions that are linked, by these.
pub(crate) fn borders(scene: &Scene<'_>, labels: &[u32]) -> Vec<Border> {
    let (grid, links) = (&scene.grid, &scene.links);
    // No pair where a step lies between.
    let mut found: Vec<((u32, u32), Option<Pair>)> = Vec::new();
    for node in 0..labels.len() {
        let mut take = |other: usize, to_the_right: bool, is_linked: bool| {
            let (a, b) = (labels[node], labels[other]);
            if a != b && a != NONE && b != NONE {
                let first = node as u32;
                let pair = Pair {
                    first,
                    to_the_right,
                };
                found.push(((a.min(b), a.max(b)), is_linked.then_some(pair)));
            }
        };
        let (column, row) = grid.column_row(node);
        if row + 1 < grid.rows {
            take(node + 1, false, links.up(node));
        }
        if column + 1 < grid.columns {
            take(node + grid.rows, true, links.right(node));
        }
    }
    found.sort_unstable();
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|chunk| {
            let pairs: Vec<Pair> = chunk.iter().filter_map(|(_, pair)| *pair).collect();
            Border {
                regions: chunk[0].0,
                steps: chunk.len() - pairs.len(),
                pairs,
                strength: None,
                stale: true,
            }
        })
        .filter(|border| !border.pairs.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Grid, Links};
    use crate::noise::noise;
    use range_image::{Lattice, RangeImage};

    #[test]
    fn a_border_tells_links_from_steps() {
        let (side, step_mm) = (20, 0.5);
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, side, side);
        for column in 0..side {
            for row in 0..side {
                // Level in the lowest six rows, a step above.
                let is_high = column >= side / 2 && row >= 6;
                image.set_z_mm(column, row, Some(if is_high { 4.0 } else { 0.0 }));
            }
        }
        let grid = Grid::new(&image);
        let scene = Scene {
            grid,
            links: Links::new(&grid, step_mm),
            noise: noise(&image, &grid),
            step_mm,
            crease_rad: 0.1,
        };
        let halves = |node: usize| if node < side * side / 2 { 1 } else { 2 };
        let labels: Vec<u32> = (0..side * side).map(halves).collect();
        let found = borders(&scene, &labels);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].pairs.len(), found[0].steps), (6, side - 6));
        let quarters = |node: usize| halves(node) + 2 * u32::from(node % side >= 6);
        let labels: Vec<u32> = (0..side * side).map(quarters).collect();
        let found = borders(&scene, &labels);
        let regions: Vec<(u32, u32)> = found.iter().map(|b| b.regions).collect();
        assert_eq!(regions, [(1, 2), (1, 3)], "steps alone are no border");
    }
}
