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
        }
        same
    });
}

/// The borders between regions, by these.
pub(crate) fn borders(scene: &Scene<'_>, labels: &[u32]) -> Vec<Border> {
    let mut found: Vec<((u32, u32), Pair)> = Vec::new();
    for node in 0..labels.len() {
        let mut take = |other: usize, to_the_right: bool| {
            let (a, b) = (labels[node], labels[other]);
            if a != b && a != NONE && b != NONE {
                let first = node as u32;
                found.push((
                    (a.min(b), a.max(b)),
                    Pair {
                        first,
                        to_the_right,
                    },
                ));
            }
        };
        if scene.links.up(node) {
            take(node + 1, false);
        }
        if scene.links.right(node) {
            take(node + scene.grid.rows, true);
        }
    }
    found.sort_unstable();
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|chunk| Border {
            regions: chunk[0].0,
            pairs: chunk.iter().map(|(_, pair)| *pair).collect(),
            strength: None,
            stale: true,
        })
        .collect()
}
