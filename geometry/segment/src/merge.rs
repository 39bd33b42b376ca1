//! Neighbouring regions whose common border is neither crease nor step become one.
//!
//! The paper (II.2) prints the condition the wrong way round; Hoffman & Jain 1987, whom it
//! follows, merge where the border is not a crease.

use crate::local_fit::{Belief, LocalFit};
use crate::scene::{NONE, Scene};
use range_image::{Cancelled, Monitor};

/// At most so many places of a border are examined.
const PLACES: usize = 16;
/// Surfaces whose normal's z is below this (60 degrees of incidence) must turn by more to count
/// as creased, in proportion.
const STEEP: f64 = 0.5;
/// Reach and margin of a look at the border from further away.
const AFAR: (usize, usize) = (8, 3);
/// What counts as a crease or step from afar, in those of close by: surfaces are carried on
/// over several nodes, which costs certainty.
const ALLOWANCE: f64 = 2.5;
/// Shorter borders, in pairs of nodes, are no ground for merging.
const LEAST_PAIRS: usize = 3;

/// A pair of linked nodes in two regions; `first` is the one with the lower number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    first: u32,
    to_the_right: bool,
}

#[derive(Debug)]
struct Border {
    /// The two regions, lower label first.
    regions: (u32, u32),
    pairs: Vec<Pair>,
    /// Below 1 the border is neither crease nor step; `None` where nothing could be measured.
    strength: Option<f64>,
    stale: bool,
}

/// Merges until every border left is a crease or a step: always the weakest border first,
/// and what has changed is measured again.
pub(crate) fn merge(
    scene: &Scene<'_>,
    labels: &mut [u32],
    reaches: &[usize],
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
            border.strength = strength(scene, labels, border, reaches);
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

fn borders(scene: &Scene<'_>, labels: &[u32]) -> Vec<Border> {
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

/// What the two surfaces do at one place of their border.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// Change of direction, radians, positive where the border is a ridge.
    turn_rad: f64,
    /// Distance between the two, millimetres square to the surface.
    jump_mm: f64,
    /// z of the mean normal: 1 faces the camera, 0 is seen edge on.
    facing: f64,
}

/// How a border measures up.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    /// Crease angle and jump, each over what is allowed, the greater of both.
    strength: f64,
    /// z of the mean normal.
    facing: f64,
}

/// The border's strength by fits of the first reach. Where surfaces are steep the least by
/// any reach: what is truly broken is so at any scale, while what only bends away sharply is
/// smoother the closer one looks. Elsewhere short fits would see no more of an edge than the
/// narrow chamfer or rounding that it may have.
fn strength(scene: &Scene<'_>, labels: &[u32], border: &Border, reaches: &[usize]) -> Option<f64> {
    let mut least = None;
    for &reach in reaches {
        let Some(near) = verdict(scene, labels, border, (reach, 1)) else {
            continue;
        };
        least = Some(least.map_or(near.strength, |s: f64| s.min(near.strength)));
        if near.facing > STEEP {
            // The sides of a narrow chamfer or rounding meet smoothly in its middle.
            let afar = verdict(scene, labels, border, AFAR).map(|v| v.strength / ALLOWANCE);
            return least.map(|s| s.max(afar.unwrap_or(0.0)));
        }
    }
    least
}

fn verdict(
    scene: &Scene<'_>,
    labels: &[u32],
    border: &Border,
    (reach, margin): (usize, usize),
) -> Option<Verdict> {
    let (a, b) = border.regions;
    let pairs = &border.pairs;
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let places = pairs.len().min(PLACES);
    let mut sums = Vec::new();
    let mut meetings = Vec::with_capacity(places);
    for place in 0..places {
        let pair = pairs[(2 * place + 1) * pairs.len() / (2 * places)];
        scene.sums_around(
            labels,
            pair.first as usize,
            (reach, margin),
            |l| l == a || l == b,
            &mut sums,
        );
        let fit = |label| sums.iter().find(|s| s.label == label)?.fit(Belief::Ready);
        if let (Some(one), Some(other)) = (fit(a), fit(b)) {
            meetings.push(meet(scene, pair, &one, &other));
        }
    }
    if 3 * meetings.len() < places {
        return None;
    }
    let median = |value: &dyn Fn(&Meeting) -> f64| {
        let mut values: Vec<f64> = meetings.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    // Noise turns this way and that, a crease one way; a border that is ridge here and
    // valley there betrays itself by sizes that noise does not explain.
    let one_way = median(&|m| m.turn_rad).abs();
    let either_way = median(&|m| m.turn_rad.abs()) - scene.turn_noise_rad(reach);
    // Steep surfaces run out of nodes: z over x and y bends ever more sharply there, and a
    // fit foretells its direction the less.
    let facing = median(&|m| m.facing);
    let crease = scene.crease_rad * (STEEP / facing).max(1.0);
    let jump = median(&|m| m.jump_mm);
    Some(Verdict {
        strength: (one_way.max(either_way) / crease).max(jump / scene.step_mm),
        facing,
    })
}

fn meet(scene: &Scene<'_>, pair: Pair, one: &LocalFit, other: &LocalFit) -> Meeting {
    let (u, v) = if pair.to_the_right {
        (0.5, 0.0)
    } else {
        (0.0, 0.5)
    };
    let pitch = scene.grid.pitch_mm;
    let (m, n) = (one.normal(pitch, u, v), other.normal(pitch, u, v));
    // On a ridge the normals lean apart, each to its own side.
    let apart = (n[0] - m[0]) * (other.centroid[0] - one.centroid[0])
        + (n[1] - m[1]) * (other.centroid[1] - one.centroid[1]);
    let turn = angle(m, n);
    let facing = 0.5 * (m[2] + n[2]);
    // The gap along z, as seen square to the mean surface.
    let gap = (one.z_mm(u, v) - other.z_mm(u, v)).abs();
    Meeting {
        turn_rad: if apart < 0.0 { -turn } else { turn },
        jump_mm: gap * facing,
        facing,
    }
}

/// Angle between unit vectors.
fn angle(m: [f64; 3], n: [f64; 3]) -> f64 {
    let cross = [
        m[1] * n[2] - m[2] * n[1],
        m[2] * n[0] - m[0] * n[2],
        m[0] * n[1] - m[1] * n[0],
    ];
    let sine = libm::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    libm::atan2(sine, m[0] * n[0] + m[1] * n[1] + m[2] * n[2])
}
