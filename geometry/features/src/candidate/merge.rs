//! Levels that are pieces of one, cut apart by something deeper that runs across.

use super::top::Top;
use crate::border::border;
use crate::levels::{AROUND, Sense};
use crate::sight::Sight;

/// Two floors lie in one plane where they are no further apart than this share of a step.
const ONE_PLANE: f64 = 0.3;
/// What cuts a floor apart runs along this share of each piece's width at least.
const ACROSS: f64 = 0.8;

/// The levels besides the top face's, those in one set that are pieces of one floor.
pub(super) fn sets(sight: &Sight<'_>, top: &Top, step_mm: f64) -> Vec<Vec<u16>> {
    let levels = sight.levels;
    let mut sets: Vec<Vec<u16>> = (0..levels.levels.len())
        .filter_map(|index| u16::try_from(index).ok())
        .filter(|level| *level != AROUND && !top.levels.contains(level))
        .map(|level| vec![level])
        .collect();
    let mut first = 0;
    while first < sets.len() {
        let second = (first + 1..sets.len()).find(|&other| {
            are_one(sight, sets[first][0], sets[other][0], step_mm)
                || run_on(sight, &sets[first], &sets[other], step_mm)
        });
        match second {
            Some(other) => {
                let more = sets.remove(other);
                sets[first].extend(more);
            }
            None => first += 1,
        }
    }
    for set in &mut sets {
        largest_first(sight, set);
    }
    sets
}

/// Puts the largest of the levels that are seen first: that is measured, and scraps of it are not.
pub(super) fn largest_first(sight: &Sight<'_>, set: &mut [u16]) {
    set.sort_by_key(|l| {
        let level = &sight.levels.levels[usize::from(*l)];
        (!level.is_seen(), std::cmp::Reverse(level.nodes), *l)
    });
}

/// Whether two floors are planes, and the larger runs through the middle of the other.
fn in_one_plane(sight: &Sight<'_>, one: u16, other: u16, step_mm: f64) -> bool {
    let of = |level: u16| &sight.levels.levels[usize::from(level)];
    let (Some(a), Some(b)) = (of(one).plane, of(other).plane) else {
        return false;
    };
    let (large, small) = if a.samples >= b.samples {
        (a, b)
    } else {
        (b, a)
    };
    let [x, y] = small.middle_mm;
    let off = (large.z_mm(x, y) - small.z_mm(x, y)).abs();
    let within = ONE_PLANE * step_mm + 3.0 * large.sigma_mm(x, y);
    off <= within && of(one).is_plane && of(other).is_plane
}

fn are_one(sight: &Sight<'_>, one: u16, other: u16, step_mm: f64) -> bool {
    if !in_one_plane(sight, one, other, step_mm) {
        return false;
    }
    let between = |level: u16| {
        let own = border(
            &sight.field.image,
            sight.regions,
            sight.levels,
            step_mm,
            &|l| l == level,
        );
        let mut cuts: Vec<(u16, usize)> = Vec::new();
        let mut rises = 0;
        for pair in own.pairs.iter().filter(|p| p.outermost) {
            match pair.sense {
                Sense::Falls if pair.beyond != AROUND => {
                    match cuts.iter_mut().find(|(l, _)| *l == pair.beyond) {
                        Some((_, count)) => *count += 1,
                        None => cuts.push((pair.beyond, 1)),
                    }
                }
                Sense::Rises => rises += 1,
                _ => {}
            }
        }
        // Square to the cut the piece is as wide as its area over its depth; its border is twice
        // the sum of both.
        let half = (cuts.iter().map(|c| c.1).sum::<usize>() + rises) as f64 / 2.0;
        let area = own.nodes as f64;
        let root = (half * half - 4.0 * area).max(0.0).sqrt();
        (cuts, [0.5 * (half - root), 0.5 * (half + root)], rises)
    };
    let (cuts, widths, rises) = between(one);
    let (other_cuts, other_widths, other_rises) = between(other);
    let runs_across = |count: usize, widths: [f64; 2]| {
        widths
            .iter()
            .any(|w| (count as f64) >= ACROSS * w && (count as f64) <= 1.5 * w)
    };
    rises > 0
        && other_rises > 0
        && cuts.iter().any(|(level, count)| {
            runs_across(*count, widths)
                && other_cuts.iter().any(|(theirs, their_count)| {
                    theirs == level && runs_across(*their_count, other_widths)
                })
        })
}

/// Of the border of two pieces of one free form this share has no step, of at least so many pairs.
const SMOOTH: f64 = 0.6;
const FEWEST_SMOOTH: usize = 3;

/// Whether two sets run on in each other, and are no two planes that meet. Where a narrow neck or the
/// foot of a wall parts a floor in the segmentation, both pieces are planes, but the same.
fn run_on(sight: &Sight<'_>, one: &[u16], other: &[u16], step_mm: f64) -> bool {
    let is_plane = |set: &[u16]| {
        let mut levels = set.iter();
        levels.all(|level| sight.levels.levels[usize::from(*level)].is_plane)
    };
    if is_plane(one) && is_plane(other) {
        let coplanar = |a: u16| other.iter().any(|b| in_one_plane(sight, a, *b, step_mm));
        if !one.iter().any(|a| coplanar(*a)) {
            return false;
        }
    }
    // A groove runs on in the plane that it is cut into, and is not part of it.
    let bows = |set: &[u16]| {
        let mut levels = set.iter();
        levels.any(|level| sight.levels.levels[usize::from(*level)].bow.is_some())
    };
    if bows(one) != bows(other) && (is_plane(one) || is_plane(other)) {
        return false;
    }
    let own = border(
        &sight.field.image,
        sight.regions,
        sight.levels,
        step_mm,
        &|level| one.contains(&level),
    );
    let common: Vec<Sense> = own
        .pairs
        .iter()
        .filter(|pair| other.contains(&pair.beyond))
        .map(|pair| pair.sense)
        .collect();
    let smooth = common.iter().filter(|s| **s == Sense::Level).count();
    smooth >= FEWEST_SMOOTH && smooth as f64 >= SMOOTH * common.len() as f64
}
