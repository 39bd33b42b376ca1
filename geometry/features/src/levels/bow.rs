//! Regions that go down from a plane and come up to it again, or up and down: grooves and dimples
//! without walls, ribs and domes. Their sides slant as strips do, but they have a floor of their own.

use std::collections::BTreeMap;

use range_image::RangeImage;

use super::contact::Contact;
use crate::border::reached;
use crate::plane::Plane;
use crate::regions::{OUTSIDE, Regions};

/// Which way a region goes from the plane that it begins and ends at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bow {
    /// Down and up again.
    Sags,
    /// Up and down again.
    Bulges,
}

impl Bow {
    /// Heights off a plane as depths (of what sags) or heights (of what bulges).
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Sags => -1.0,
            Self::Bulges => 1.0,
        }
    }
}

/// Of the border of such a region so much at least is without a step, against one plane.
const LEAST_SHARE: f64 = 0.2;
/// The height of a region is that which this share of its nodes does not reach: the others may stray.
const STRAYS: f64 = 0.02;
/// Nodes that have this share of it are its floor.
const FLOOR: f64 = 0.8;
/// From there it comes back by this share on both sides ...
const BACK: f64 = 0.4;
/// ... of so many of its floor's nodes. A strip comes back nowhere, a ring around a hole (seen along
/// lines that miss the hole) on some.
const RETURNS: f64 = 0.5;
/// What leans by more than this against the scan's axes may be the side of one that has two, radians: 4
/// degrees.
pub(super) const LEAST_SLOPE_RAD: f64 = 0.07;
/// Fewest nodes of a region that is asked.
const FEWEST: usize = 25;
/// Regions run on in one another where this share of their border has no step.
const RUNS_ON: f64 = 0.6;
/// What encloses more than this share of its own nodes is a ring: the chamfers of a pocket.
const ENCLOSED: f64 = 0.02;
/// What slants between it and the plane and has no more nodes than this share of its own is a scrap of
/// it: where it is steep, its rim.
const SCRAP: f64 = 0.1;

/// Which regions bow, and of which they are a part: their own, but where several make one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) bow: Bow,
    /// The largest of them.
    pub(super) of: u16,
}

/// What of each region bows. Slanting regions that run on in one another, as the sides of a V-groove
/// do, are asked together where they do not alone.
pub(super) fn bows(
    image: &RangeImage,
    regions: &Regions,
    contacts: &BTreeMap<(u16, u16), Contact>,
    step_mm: f64,
    slants: &dyn Fn(u16) -> bool,
) -> Vec<Option<Part>> {
    let mut nodes: Vec<Vec<usize>> = vec![Vec::new(); regions.regions.len()];
    for (node, label) in regions.labels.iter().enumerate() {
        if !image.raw_z_mm()[node].is_nan() {
            nodes[usize::from(*label)].push(node);
        }
    }
    let bow_of = |group: &[u16]| {
        let plane = beside(regions, contacts, group, slants)?;
        let mut own: Vec<usize> = group
            .iter()
            .flat_map(|region| nodes[usize::from(*region)].iter().copied())
            .collect();
        own.sort_unstable();
        bow(image, regions, (group, &own), &plane, step_mm)
    };
    let all = || (0..regions.regions.len()).filter_map(|index| u16::try_from(index).ok());
    let is_curved = |region: u16| regions.surface(region).is_some_and(|own| !own.is_plane);
    let mut found: Vec<Option<Part>> = all()
        .map(|region| {
            let bow = is_curved(region).then(|| bow_of(&[region])).flatten()?;
            Some(Part { bow, of: region })
        })
        .collect();
    let is_open = |region: u16, found: &[Option<Part>]| {
        let slants = regions.surface(region).is_some() && slants(region);
        slants && found[usize::from(region)].is_none()
    };
    for first in all() {
        if !is_open(first, &found) {
            continue;
        }
        let mut group = vec![first];
        let mut next = 0;
        while let Some(own) = group.get(next).copied() {
            next += 1;
            let beside = contacts.range((own, 0)..=(own, u16::MAX));
            for ((_, other), contact) in beside {
                let runs_on = contact.level as f64 >= RUNS_ON * contact.all() as f64;
                if runs_on && is_open(*other, &found) && !group.contains(other) {
                    group.push(*other);
                }
            }
        }
        if group.len() > 1
            && let Some(bow) = bow_of(&group)
            && let Some(of) = group
                .iter()
                .copied()
                .max_by_key(|own| (nodes[usize::from(*own)].len(), std::cmp::Reverse(*own)))
        {
            for own in group {
                found[usize::from(own)] = Some(Part { bow, of });
            }
        }
    }
    found
}

/// Whether a region may be a scrap of another that it meets.
pub(super) fn is_scrap(regions: &Regions, scrap: u16, of: u16) -> bool {
    match (regions.surface(scrap), regions.surface(of)) {
        (Some(scrap), Some(of)) => scrap.nodes as f64 <= SCRAP * of.nodes as f64,
        _ => false,
    }
}

/// The plane that regions, with their scraps, meet without a step along most of its border.
fn beside(
    regions: &Regions,
    contacts: &BTreeMap<(u16, u16), Contact>,
    group: &[u16],
    slants: &dyn Fn(u16) -> bool,
) -> Option<Plane> {
    let of = |region: u16| {
        let beside = contacts.range((region, 0)..=(region, u16::MAX));
        beside.map(|((_, other), contact)| (*other, *contact))
    };
    let mut whole = group.to_vec();
    for own in group {
        let scraps = of(*own).filter(|(other, contact)| {
            contact.level > 0 && slants(*other) && is_scrap(regions, *other, *own)
        });
        whole.extend(scraps.map(|(other, _)| other));
    }
    whole.sort_unstable();
    whole.dedup();
    let is_own = |region: u16| whole.contains(&region);
    let mut all = 0;
    let mut level: BTreeMap<u16, usize> = BTreeMap::new();
    for region in whole.iter().copied() {
        for (other, contact) in of(region).filter(|(other, _)| !is_own(*other)) {
            all += contact.all();
            *level.entry(other).or_default() += contact.level;
        }
    }
    level
        .into_iter()
        .filter(|(other, count)| *other != OUTSIDE && *count as f64 >= LEAST_SHARE * all as f64)
        .filter_map(|(other, count)| {
            let surface = regions.surface(other).filter(|own| own.is_plane)?;
            (!slants(other)).then_some((count, std::cmp::Reverse(other), surface.plane))
        })
        .max_by_key(|(count, other, _)| (*count, *other))
        .map(|(_, _, plane)| plane)
}

fn bow(
    image: &RangeImage,
    regions: &Regions,
    (group, nodes): (&[u16], &[usize]),
    plane: &Plane,
    step_mm: f64,
) -> Option<Bow> {
    if nodes.len() < FEWEST {
        return None;
    }
    let rows = regions.rows;
    let is_own: Vec<bool> = regions
        .labels
        .iter()
        .map(|own| group.contains(own))
        .collect();
    let off_mm = |node: usize| {
        let (column, row) = (node / rows, node % rows);
        image.raw_z_mm()[node] - plane.z_mm(image.x_mm(column), image.y_mm(row))
    };
    let mut sorted: Vec<f64> = nodes.iter().map(|node| off_mm(*node)).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    let (low, high) = (-at(STRAYS), at(1.0 - STRAYS));
    let (bow, height_mm) = if low > high {
        (Bow::Sags, low)
    } else {
        (Bow::Bulges, high)
    };
    if height_mm < step_mm {
        return None;
    }
    let height = |node: usize| bow.sign() * off_mm(node);
    let returns = [1, rows].map(|step| returning((nodes, &is_own), rows, step, height_mm, &height));
    let floor: Vec<usize> = nodes
        .iter()
        .copied()
        .filter(|node| height(*node) >= FLOOR * height_mm)
        .collect();
    let most = returns
        .iter()
        .map(|returns| floor.iter().filter(|node| returns[**node]).count())
        .max()?;
    if most as f64 <= RETURNS * floor.len() as f64 {
        return None;
    }
    let reached = reached(regions, &is_own);
    let enclosed = enclosed(regions, &is_own, &reached);
    (enclosed as f64 <= ENCLOSED * nodes.len() as f64).then_some(bow)
}

/// How many nodes lie within the outer border of nodes without being of them.
fn enclosed(regions: &Regions, is_own: &[bool], reached: &[bool]) -> usize {
    let rows = regions.rows;
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for node in (0..is_own.len()).filter(|node| is_own[*node]) {
        for (axis, at) in [node / rows, node % rows].into_iter().enumerate() {
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    let is_within = |node: &usize| {
        let within = |axis: usize, at: usize| (low[axis]..=high[axis]).contains(&at);
        within(0, node / rows) && within(1, node % rows)
    };
    (0..is_own.len())
        .filter(|node| !is_own[*node] && !reached[*node])
        .filter(is_within)
        .count()
}

/// Which nodes lie on a stretch along one way of the grid that begins and ends lower than the region
/// is high, both by the least share of it.
fn returning(
    (nodes, is_own): (&[usize], &[bool]),
    rows: usize,
    step: usize,
    height_mm: f64,
    height: &dyn Fn(usize) -> f64,
) -> Vec<bool> {
    let mut returns = vec![false; is_own.len()];
    let mut seen = returns.clone();
    for &first in nodes {
        if seen[first] {
            continue;
        }
        // Nodes are in order: none of a stretch comes before its first.
        let mut stretch = Vec::new();
        let mut node = first;
        loop {
            seen[node] = true;
            stretch.push(node);
            let next = node + step;
            let same_line = step != 1 || !next.is_multiple_of(rows);
            if !same_line || is_own.get(next) != Some(&true) {
                break;
            }
            node = next;
        }
        let heights: Vec<f64> = stretch
            .iter()
            .map(|node| height(*node))
            .filter(|own| !own.is_nan())
            .collect();
        let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let is_low = |end: Option<&f64>| end.is_some_and(|end| *end <= top - BACK * height_mm);
        if is_low(heights.first()) && is_low(heights.last()) {
            for node in stretch {
                returns[node] = true;
            }
        }
    }
    returns
}
