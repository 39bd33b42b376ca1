//! Whose edge a slanting strip runs along.

use crate::candidate::{Candidate, Lie};
use crate::levels::Strip;
use crate::sight::Sight;

/// The candidate whose edge a strip runs along: a hollow in the face that it falls from, or that
/// face's own.
pub(super) fn owner(sight: &Sight<'_>, found: &[Candidate], strip: &Strip) -> Option<usize> {
    let regions = sight.regions;
    let mut beside = vec![0_usize; sight.levels.levels.len()];
    for node in 0..regions.labels.len() {
        if regions.labels[node] != strip.region {
            continue;
        }
        for other in regions.neighbours(node) {
            let level = sight.levels.labels[other];
            if level != strip.level {
                beside[usize::from(level)] += 1;
            }
        }
    }
    let holder = |level: u16| found.iter().position(|c| c.levels.contains(&level));
    let own = holder(strip.level)?;
    let most = (0..beside.len())
        .filter(|k| beside[*k] > 0)
        .max_by_key(|k| beside[*k]);
    let other = most.and_then(|k| holder(u16::try_from(k).ok()?));
    let Some(other) = other.filter(|other| *other != own) else {
        return Some(own);
    };
    let goes_into = found[other].host != 0 && found[own].levels.contains(&found[other].host);
    let is_others = match (strip.falls, found[other].lie) {
        // Falls into a hollow of its face, or rises to what stands on its floor.
        (true, Lie::Hollow) | (false, Lie::Raised) => goes_into,
        _ => false,
    };
    Some(if is_others { other } else { own })
}
